"""Mutation testing of the safety path: `make mutants`, or `python tests/mutation/run.py MODULE... --seconds N`.

Each mutant is written into a copy of the sources and judged by the tests that targets.toml maps to its module, in a
process forked from one with the libraries already loaded. Exit code 1: a mutant survived that explained.toml does not
name; 3: none did, but some were not judged in time.
"""

import argparse
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
import tomllib
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from operators import Mutant, mutants_of

ROOT = Path(__file__).parents[2]
HERE = Path(__file__).parent
COPIED = ("groundstation", "drivers", "sim_bridge", "tests", "config", "docs", "pyproject.toml", ".importlinter")
# Our modules must be imported anew, and pytest's plugins by pytest itself.
NOT_BEFOREHAND = ("groundstation", "drivers", "sim_bridge", "tests", "conftest", "hypothesis", "pytest_timeout")
QUIET = (
    "-x",
    "-q",
    "--no-header",
    "-p",
    "no:cacheprovider",
    "-p",
    "no:faulthandler",
    "-W",
    "ignore::pytest.PytestAssertRewriteWarning",
    "-m",
    "not slow",
    "--timeout",
    "60",
)
KILLED, SURVIVED, LATE, BROKEN = "killed", "survived", "late", "no tests"
UNFINISHED = 3


@dataclass(frozen=True, slots=True)
class Share:
    """The mutants of a module to be judged: every parts-th from the part-th on; of these all, or a seeded sample."""

    part: int
    parts: int
    sample: int
    seed: int

    @classmethod
    def parsed(cls, part: str, sample: int, seed: int) -> "Share":
        """Read K/N."""
        k, n = (int(number) for number in part.split("/"))
        if not 1 <= k <= n:
            raise ValueError(f"part {part}: K/N with K from 1 to N")
        return cls(k, n, sample, seed)

    def of(self, mutants: list[Mutant]) -> list[Mutant]:
        """Return the chosen mutants of one module."""
        mine = mutants[self.part - 1 :: self.parts]
        return random.Random(self.seed).sample(mine, min(self.sample, len(mine))) if self.sample else mine


class Bench:
    """A copy of the sources, in which one module after the other is changed."""

    def __init__(self, folder: Path, module: str, tests: list[str]) -> None:
        self._path, self._tests = folder / module, tests
        self._original = self._path.read_text(encoding="utf-8")
        for stale in self._path.parent.glob(f"__pycache__/{self._path.stem}.*.pyc"):
            stale.unlink()
        self.mutants = mutants_of(self._original)
        self.baseline_s = 0.0

    def prepare(self) -> str:
        """Run the tests of the unchanged module, then again with libraries loaded; returns their fault, if any."""
        for _ in range(2):
            began = time.monotonic()
            code, modules = self._judge(self._original, 600.0)
            self.baseline_s = time.monotonic() - began
            if code != 0:
                return f"its tests end with {code} before anything is changed"
            for name in modules:
                if not name.lstrip("_").startswith(NOT_BEFOREHAND):
                    try:
                        __import__(name)
                    except ImportError:
                        continue
        return ""

    def verdict(self, mutant: Mutant) -> str:
        """Return the outcome of a mutant."""
        code, _ = self._judge(mutant.source, 3.0 * self.baseline_s + 10.0)
        return {0: SURVIVED, -1: LATE, 5: BROKEN}.get(code, KILLED)

    def close(self) -> None:
        """Restore the copy."""
        self._path.write_text(self._original, encoding="utf-8")

    def _judge(self, source: str, limit_s: float) -> tuple[int, list[str]]:
        self._path.write_text(source, encoding="utf-8")
        read, write = os.pipe()
        pid = os.fork()
        if pid == 0:
            os.close(read)
            _run_tests(self._tests, write)
        os.close(write)
        return _await(pid, read, limit_s)


def _run_tests(tests: list[str], write: int) -> None:
    """Run in the child; never returns."""
    os.setsid()
    sink = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1, 2):
        os.dup2(sink, descriptor)
    code = 99
    try:
        import pytest

        code = int(pytest.main([*QUIET, *tests]))
        os.write(write, json.dumps([name for name in sys.modules if name != "__main__"]).encode()[:60_000] or b"[]")
    finally:
        os._exit(code)


def _await(pid: int, read: int, limit_s: float) -> tuple[int, list[str]]:
    """Return the exit code (-1: time-out, ended with its child processes) and the modules that it loaded."""
    deadline = time.monotonic() + limit_s
    while os.waitid(os.P_PID, pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
        if time.monotonic() > deadline:
            break
        time.sleep(0.01)
    late = os.waitid(os.P_PID, pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None
    with suppress(ProcessLookupError):  # it leads its own session, which ends with all processes that its tests started
        os.killpg(pid, signal.SIGKILL)
    _, status = os.waitpid(pid, 0)
    text = os.read(read, 65_536) if not late else b""
    os.close(read)
    try:
        modules = json.loads(text or b"[]")
    except json.JSONDecodeError:
        modules = []
    return (-1 if late else os.waitstatus_to_exitcode(status)), modules


def explained(module: str) -> dict[str, str]:
    """Return the reasons of known survivors of a module, by the mutants' names without numbers."""
    rows = tomllib.loads((HERE / "explained.toml").read_text(encoding="utf-8")).get(module, {})
    return {str(name): str(why) for name, why in rows.items()}


def main() -> int:
    """Judge the mutants of the named modules, or of all."""
    targets: dict[str, list[str]] = tomllib.loads((HERE / "targets.toml").read_text(encoding="utf-8"))
    told = _told()
    share = Share.parsed(told.part, told.sample, told.seed)
    chosen = [name for name in targets if not told.modules or any(part in name for part in told.modules)]
    deadline, unexplained, left = time.monotonic() + told.seconds, 0, 0
    sys.dont_write_bytecode = True
    os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
    with tempfile.TemporaryDirectory(prefix="skein-mutants-") as name:
        folder = Path(name)
        for part in COPIED:
            (shutil.copytree if (ROOT / part).is_dir() else shutil.copy2)(ROOT / part, folder / part)
        os.chdir(folder)
        sys.path.insert(0, str(folder))
        os.environ["PYTHONPATH"] = str(folder)
        for module in chosen:
            survived, not_judged = _module(Bench(folder, module, targets[module]), module, share, deadline)
            unexplained, left = unexplained + survived, left + not_judged
    print(f"{unexplained} survived unexplained; {left} not judged for want of time", flush=True)
    return 1 if unexplained else UNFINISHED if left else 0


def _told() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("modules", nargs="*", help="parts of module paths; default: all of targets.toml")
    parser.add_argument("--seconds", type=float, default=1200.0, help="stop after so long, and say what is left")
    parser.add_argument("--part", default="1/1", help="K/N: of each module every N-th mutant from the K-th on")
    parser.add_argument("--sample", type=int, default=0, help="so many mutants of each module, drawn by --seed")
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args()


def _module(bench: Bench, module: str, share: Share, deadline: float) -> tuple[int, int]:
    """Judge a module's mutants; returns the numbers of unexplained survivors, and of mutants not judged."""
    mutants, counts, survivors = share.of(bench.mutants), Counter[str](), list[Mutant]()
    if time.monotonic() > deadline:
        print(f"{module}: none of {len(mutants)} judged", flush=True)
        return 0, len(mutants)
    if fault := bench.prepare():
        print(f"{module}: {fault}", flush=True)
        return 1, 0
    for mutant in mutants:
        if time.monotonic() > deadline:
            break
        verdict = bench.verdict(mutant)
        counts[verdict] += 1
        if verdict in (SURVIVED, BROKEN):
            survivors.append(mutant)
    bench.close()
    late = f", {counts[LATE]} of them by taking too long" * bool(counts[LATE])
    print(
        f"{module}: {counts[KILLED] + counts[LATE]} of {counts.total()} killed{late} "
        f"({len(bench.mutants)} in all; {bench.baseline_s:.1f} s each)",
        flush=True,
    )
    return _tell(survivors, module), len(mutants) - counts.total()


def _tell(survivors: list[Mutant], module: str) -> int:
    """Name the survivors; returns the number of unexplained ones."""
    known, open_ends = explained(module), 0
    for mutant in survivors:
        why = known.get(mutant.name.partition(" #")[0], "")
        open_ends += not why
        print(
            f"  {'explained' if why else 'SURVIVED'} {module}:{mutant.line} {mutant.name}{f' ({why})' * bool(why)}",
            flush=True,
        )
    return open_ends


if __name__ == "__main__":
    sys.exit(main())
