"""Runs a peer of the planner in a process of its own, so that one that hangs or grows loses only its row."""

import multiprocessing
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Any

from groundstation.experiments.planar.parameters import PlanarParameters

# A solve of the naive peer is estimated instead of run when one topology alone would take this share of its time.
_SHARE = 0.5


@dataclass(frozen=True, slots=True)
class Measured:
    """One control step of a peer: CPU time, result, and whether the time is partly extrapolated."""

    cpu_ms: float
    evaluations: int
    topologies: int
    cost: float | None
    extrapolated: bool
    peak_memory_mb: float


class PeerProcess:
    """A peer behind a pipe; context manager. `measure` returns None when the peer failed or took too long."""

    def __init__(self, name: str, limit_s: float) -> None:
        self.name, self.limit_s, self.failure = name, limit_s, ""
        self._context = multiprocessing.get_context("spawn")
        self._process: Any = None
        self._pipe: Connection | None = None

    def __enter__(self) -> "PeerProcess":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        self._end()

    def measure(self, robots: int, layout: str, seed: int, parameters: PlanarParameters) -> Measured | None:
        """Return one timed step on the bench belief; None: see `failure`."""
        if self._pipe is None:
            self._pipe, other = self._context.Pipe()
            self._process = self._context.Process(target=_serve, args=(self.name, other, self.limit_s), daemon=True)
            self._process.start()
            other.close()
        try:
            self._pipe.send((robots, layout, seed, parameters))
            if self._pipe.poll(3.0 * self.limit_s + 60.0):
                answer = self._pipe.recv()
                if isinstance(answer, Measured):
                    return answer
                self.failure = str(answer)
                return None
            self.failure = "timed out"
        except (EOFError, OSError):
            self.failure = "its process died"
        self._end()
        return None

    def _end(self) -> None:
        if self._pipe is not None:
            self._pipe.close()
        if self._process is not None and self._process.is_alive():
            self._process.kill()
            self._process.join(5.0)
        self._pipe = self._process = None


def _serve(name: str, pipe: Connection, limit_s: float) -> None:
    """Answer requests until the pipe closes; errors are sent as text."""
    while True:
        try:
            robots, layout, seed, parameters = pipe.recv()
        except EOFError:
            return
        try:
            answer: Any = _measure(name, robots, layout, seed, parameters, limit_s)
        except (ArithmeticError, ImportError, MemoryError, RuntimeError, ValueError) as error:
            answer = f"{type(error).__name__}: {error}"
        pipe.send(answer)


def _measure(name: str, robots: int, layout: str, seed: int, parameters: PlanarParameters, limit_s: float) -> Measured:
    from groundstation.bench import planner_peer_jax
    from groundstation.bench.planner_peers import naive, numpy_adjoint
    from groundstation.experiments.planar.scenarios import bench_belief

    mean, covariance, level = bench_belief(robots, layout, seed, parameters)
    levels = tuple(int(k) for k in level)
    if name == "naive":
        guess = _naive_guess(mean, covariance, levels, parameters, limit_s)
        if guess is not None:
            return guess
    solve = {"naive": naive.solve, "numpy": numpy_adjoint.solve, "jax": planner_peer_jax.solve}[name]
    # Untimed, as ours has an untimed step: one topology (the batch of JAX compiles, and cannot be stopped).
    solve(mean, covariance, levels, parameters, lambda: True)
    before, begin = time.process_time(), time.monotonic()
    step = solve(mean, covariance, levels, parameters, lambda: time.monotonic() - begin > limit_s)
    cpu_ms = 1e3 * (time.process_time() - before)
    partial = step.solved < step.topologies
    scale = step.topologies / step.solved
    return Measured(
        cpu_ms * scale,
        round(step.evaluations * scale),
        step.topologies,
        None if partial else step.cost,
        partial,
        peak_memory_mb(),
    )


def _naive_guess(mean: Any, covariance: Any, levels: Any, parameters: Any, limit_s: float) -> Measured | None:
    """Return one evaluation times the counted evaluations, when the current topology alone would take too long.

    The counts are those of the same optimiser on the same cost with exact gradients, times 2n + 1 for differences; the
    one evaluation that scales a topology's cost has none.
    """
    import numpy as np

    from groundstation.bench.planner_peers import naive, numpy_adjoint
    from groundstation.bench.planner_peers.step import edges_of

    full, zero = np.kron(covariance, np.eye(2)), np.zeros(2 * len(levels))
    edges, once = edges_of(levels), np.inf
    for _ in range(3):
        before = time.process_time()
        naive.rollout_cost(zero, mean, full, edges, parameters)
        once = min(once, time.process_time() - before)
    begin = time.monotonic()
    step = numpy_adjoint.solve(mean, covariance, levels, parameters, lambda: time.monotonic() - begin > 0.2 * limit_s)
    calls = naive_calls(len(levels), step.evaluations / step.solved)
    if once * calls < _SHARE * limit_s:
        return None
    count = round(calls * step.topologies)
    return Measured(1e3 * once * count, count, step.topologies, None, True, peak_memory_mb())


def naive_calls(robots: int, evaluations: float) -> float:
    """Return the cost evaluations of a topology by differences, given those with exact gradients and the first one."""
    return (2 * robots + 1) * (evaluations - 1.0) + 1.0


def peak_memory_mb() -> float:
    """Return the largest resident size of this process so far [MB]; 0 if the system does not report it.

    Not ru_maxrss, which a child inherits from the process that started it.
    """
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    except OSError:
        return 0.0
    return next((float(line.split()[1]) / 1024.0 for line in lines if line.startswith("VmHWM")), 0.0)
