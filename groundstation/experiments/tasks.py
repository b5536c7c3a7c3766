"""One run of a planar experiment as a value: its set-up, and its figures of merit."""

import csv
import hashlib
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.experiments.closed_loop import SimulatedStep, SimulationSettings, run
from groundstation.experiments.paths import Path, figure_eight, receding
from groundstation.experiments.planar.parameters import FIGURE_1, PlanarParameters
from groundstation.experiments.strategies import Strategy
from groundstation.process.program_digest import program_digest

LOST_M = 0.5

# The authors' program: horizon of 1 s at 10 Hz, reading std 0.03 m growing with distance, robots wander 0.032 m a step.
FIGURE_EIGHT = PlanarParameters(
    sigma_m=0.03,
    range_m=0.45,
    softness_m=0.03,
    robot_noise_m2_s=1e-2,
    target_noise_m2_s=5e-3,
    step_s=0.1,
    steps=10,
    discount=0.8,
    max_speed_m_s=0.5,
)


@dataclass(frozen=True, slots=True)
class Task:
    """One seeded run; equal tasks give equal results, bit for bit.

    experiment: figure1, teams or figure-eight; start: first topology; hysteresis, fuse_all: departures
    from the paper (none for strategy `paper`); range_m, noise_growth, dropout, kidnap: the world (None: the setup's).
    """

    experiment: str
    robots: int
    strategy: str
    seed: int
    start: str = "string"
    hysteresis: float = 0.0
    fuse_all: bool = False
    steps: int | None = None
    range_m: float | None = None
    noise_growth: float | None = None
    dropout: float = 0.0
    kidnap: float = 0.0

    @property
    def key(self) -> str:
        """Return a name that only equal tasks of the same program share."""
        text = json.dumps(asdict(self), sort_keys=True) + program_digest()
        digest = hashlib.sha256(text.encode()).hexdigest()[:12]
        return f"{self.experiment}-{self.robots:03d}-{self.strategy}-{self.seed:04d}-{digest}"


@dataclass(frozen=True, slots=True)
class ExperimentSetup:
    """Set-up of an experiment: planner's parameters, world, length, the target's path, the robots' first places."""

    parameters: PlanarParameters
    settings: SimulationSettings
    distance_m: float
    speed_m_s: float

    def path(self, angle_rad: float) -> Path:
        """Return the target's path; speed 0 stands for the figure of eight."""
        return receding(self.distance_m, self.speed_m_s, angle_rad) if self.speed_m_s else figure_eight()


SETUPS = {
    "figure1": ExperimentSetup(FIGURE_1, SimulationSettings(187, initial_variance=1e-3), 0.95, 0.02),
    "teams": ExperimentSetup(FIGURE_1, SimulationSettings(60, initial_variance=1e-3), 1.2, 0.02),
    "figure-eight": ExperimentSetup(
        FIGURE_EIGHT,
        SimulationSettings(224, noise_growth=25.0, initial_variance=1e-4, target_q=0.04, target_velocity=True),
        0.0,
        0.0,
    ),
}
_SCATTER_M = 0.05

# Departures of `certified` and `global`.
# PAPER (docs/explanation/method.md 7): greedy switching, edges of the topology only, hard range.
DEPARTURES: dict[str, dict[str, Any]] = {
    "figure1": {"hysteresis": 0.005},
    "teams": {"hysteresis": 0.005},
    "figure-eight": {"hysteresis": 0.15, "fuse_all": True},
}


def simulate(task: Task) -> list[SimulatedStep]:
    """Return all steps of a task; raises ValueError for an unknown experiment or strategy."""
    if task.experiment not in SETUPS:
        raise ValueError(f"unknown experiment {task.experiment!r}: choose one of {', '.join(SETUPS)}")
    setup = SETUPS[task.experiment]
    generator = np.random.default_rng([task.seed, task.robots, list(SETUPS).index(task.experiment)])
    angle = generator.uniform(-np.pi, np.pi)
    place = np.linspace(0.0, setup.distance_m, task.robots + 2)[1:-1]
    ray = np.array([np.cos(angle), np.sin(angle)])
    start = np.outer(place, ray) + generator.normal(0.0, _SCATTER_M, (task.robots, 2))
    strategy = Strategy(task.strategy, task.robots, setup.parameters, generator, task.start, task.hysteresis)
    return run(strategy, start, setup.path(float(angle)), setup.parameters, _settings(task, setup), generator)


def _settings(task: Task, setup: ExperimentSetup) -> SimulationSettings:
    own = setup.settings
    return replace(
        own,
        steps=own.steps if task.steps is None else task.steps,
        range_m=own.range_m if task.range_m is None else task.range_m,
        noise_growth=own.noise_growth if task.noise_growth is None else task.noise_growth,
        dropout=task.dropout,
        kidnap=task.kidnap,
        fuse_all=task.fuse_all,
    )


def execute(task: Task) -> dict[str, Any]:
    """Return the row of a task: its fields, its figures of merit, and its CPU times (the only part that varies)."""
    return row_of(task, simulate(task))


def row_of(task: Task, steps: Sequence[SimulatedStep]) -> dict[str, Any]:
    """Return the row of a finished run."""
    error = np.array([step.error_m for step in steps])
    trace = np.array([step.trace for step in steps])
    cpu_ms = 1e3 * np.array([step.cpu_s for step in steps])
    levels = np.array([int(step.level.max()) + 1 for step in steps])
    switches = sum(int((a.level != b.level).any()) for a, b in pairwise(steps))
    merits: dict[str, Any] = {
        "mean_trace_m2": float(trace.mean()),
        "rmse_m": float(np.sqrt((error**2).mean())),
        "max_error_m": float(error.max()),
        "lost": bool(error.max() > LOST_M),
        "switches": switches,
        "levels_last": int(levels[-1]),
        "readings_per_step": float(np.mean([step.readings for step in steps])),
        "consistency": float((error**2 / trace).mean()),
    }
    if task.experiment == "figure1":
        merits |= figure1_merits(steps, levels)
    timing = {"cpu_ms_median": float(np.median(cpu_ms)), "cpu_ms_p99": float(np.percentile(cpu_ms, 99))}
    return {"task": asdict(task), "merits": merits, "timing": timing}


def figure1_merits(steps: Sequence[SimulatedStep], levels: NDArray[np.int64]) -> dict[str, Any]:
    """Return the number of decisions until there were two levels, and the share of steps beyond 1.5 m with three."""
    distance = np.array([float(np.hypot(*step.truth[-1])) for step in steps])
    two = np.flatnonzero(levels == 2)
    far = levels[distance > 1.5]
    return {
        "decisions_to_two_levels": int(two[0]) + 1 if len(two) else None,
        "share_three_levels_beyond_1_5_m": float((far == 3).mean()) if len(far) else None,
        "as_in_the_paper": bool(len(two) and two[0] < 3 and len(far) and (far == 3).mean() > 0.9),
    }


def csv_text(rows: Sequence[Mapping[str, Any]], parts: Sequence[str] = ("task", "merits")) -> str:
    """Return rows as CSV with the chosen parts side by side; numbers as Python writes them, so nothing is rounded."""
    flat = [{key: value for part in parts for key, value in row[part].items()} for row in rows]
    out = io.StringIO()
    writer = csv.DictWriter(out, list(flat[0]) if flat else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows(flat)
    return out.getvalue()
