"""The simulation loop: decide, move with noise, observe along the topology's edges, filter."""

import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from groundstation.arrays import Array, IntArray
from groundstation.experiments.filter import PlanarBelief, correct, initial_belief, predict
from groundstation.experiments.paths import Path
from groundstation.experiments.planar.parameters import PlanarParameters
from groundstation.experiments.strategies import Strategy


@dataclass(frozen=True, slots=True)
class SimulationSettings:
    """Settings of world and filter besides the planner's parameters.

    range_m: beyond it a reading does not exist; noise_growth: reading variance sigma^2 (1 + growth d^4) [1/m^4];
    dropout: share of readings lost; kidnap: chance per step that the target jumps by up to kidnap_m; target_q: variance
    per step that the filter gives the target; target_velocity: whether the filter models it; fuse_all: fuse every
    reading within range, not only those along the topology's edges.
    """

    steps: int
    range_m: float = 0.5
    noise_growth: float = 0.0
    dropout: float = 0.0
    kidnap: float = 0.0
    kidnap_m: float = 0.5
    initial_variance: float = 1e-4
    target_q: float | None = None
    target_velocity: bool = False
    fuse_all: bool = False


class SimulatedStep(NamedTuple):
    """One step of a run: truth and mean of robots and target (n + 1, 2), covariance, decision, its cost."""

    truth: Array
    mean: Array
    covariance: Array
    level: IntArray
    trace: float
    error_m: float
    readings: int
    cpu_s: float
    evaluations: int


def run(
    strategy: Strategy,
    start: Array,
    path: Path,
    parameters: PlanarParameters,
    settings: SimulationSettings,
    generator: np.random.Generator,
) -> list[SimulatedStep]:
    """Return all steps of a closed-loop run from robot positions (n, 2); the same for the same generator state."""
    truth = np.vstack([start, path(0.0)])
    belief = initial_belief(truth, settings.initial_variance, settings.target_velocity)
    offset, steps = np.zeros(2), []
    robot_q = parameters.robot_noise_m2_s * parameters.step_s
    target_q = parameters.target_noise_m2_s * parameters.step_s if settings.target_q is None else settings.target_q
    for k in range(settings.steps):
        before = time.process_time()
        decision = strategy.decide(belief)
        cpu = time.process_time() - before
        truth[:-1] += parameters.step_s * decision.velocity_m_s
        truth[:-1] += generator.normal(0.0, np.sqrt(robot_q), truth[:-1].shape)
        kidnapped = generator.random() < settings.kidnap
        if kidnapped:
            offset = offset + generator.uniform(-settings.kidnap_m, settings.kidnap_m, 2)
        truth[-1] = path((k + 1) * parameters.step_s) + offset
        belief = predict(belief, decision.velocity_m_s, parameters.step_s, robot_q, target_q)
        if kidnapped:
            belief = forget_target(belief)
        belief, readings = observe(belief, truth, decision.level, parameters, settings, generator)
        error = float(np.hypot(*(belief.mean[belief.robots] - truth[-1])))
        steps.append(
            SimulatedStep(
                truth.copy(),
                belief.positions.copy(),
                belief.position_covariance,
                decision.level,
                belief.target_trace,
                error,
                readings,
                cpu,
                decision.evaluations,
            )
        )
    return steps


def forget_target(belief: PlanarBelief) -> PlanarBelief:
    """Return the belief with the target's block reset to a variance of 4 m^2.

    PAPER (docs/explanation/method.md 7): its kidnap test announces the jump to the filter in this way.
    """
    covariance = belief.covariance.copy()
    covariance[belief.robots :, :] = 0.0
    covariance[:, belief.robots :] = 0.0
    own = range(belief.robots, len(covariance))
    covariance[own, own] = 4.0
    return PlanarBelief(belief.mean, covariance, belief.robots)


def edges_of(level: IntArray) -> list[tuple[int, int]]:
    """Return the (observer, subject) pairs of a level vector; -1 is the global sensor, n the target."""
    ends = [-1, *level.tolist(), int(level.max()) + 1]
    return [(a - 1, b - 1) for a, upper in enumerate(ends) for b, lower in enumerate(ends) if lower == upper + 1]


def all_pairs(robots: int) -> list[tuple[int, int]]:
    """Return all (observer, subject) pairs; the global sensor never observes the target."""
    pairs = [(-1, b) for b in range(robots)]
    return pairs + [(a, b) for a in range(robots) for b in range(robots + 1) if a != b]


def observe(
    belief: PlanarBelief,
    truth: Array,
    level: IntArray,
    parameters: PlanarParameters,
    settings: SimulationSettings,
    generator: np.random.Generator,
) -> tuple[PlanarBelief, int]:
    """Fuse one reading for every edge of the topology whose ends are within range; return their number.

    PAPER (docs/explanation/method.md 7): the filter uses edges of the selected topology; with `fuse_all` all readings.
    """
    readings = 0
    for observer, subject in all_pairs(len(level)) if settings.fuse_all else edges_of(level):
        true = truth[subject] - (truth[observer] if observer >= 0 else 0.0)
        distance = float(np.hypot(*true))
        variance = parameters.sigma_m**2 * (1.0 + settings.noise_growth * distance**4)
        noise, lost = generator.normal(0.0, np.sqrt(variance), 2), generator.random() < settings.dropout
        if distance > settings.range_m or lost:
            continue
        belief = correct(belief, int(observer), int(subject), true + noise, variance)
        readings += 1
    return belief, readings
