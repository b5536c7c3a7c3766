"""Finds the best topology for each sensor: closed loops of fixed topologies under six sensor models.

Readings need not be isotropic here, so the filter is a full EKF over both axes. The planar planner moves the robots
in the fixed topology; if it cannot model the sensor, it plans with the nearest disc.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from groundstation.arrays import Array, IntArray
from groundstation.experiments.closed_loop import edges_of
from groundstation.experiments.paths import receding
from groundstation.experiments.planar.parameters import FIGURE_1
from groundstation.experiments.planar.planner import PlanarPlanner, SearchMode, SearchOptions


@dataclass(frozen=True, slots=True)
class PlanarSensor:
    """A robot's sensor: `kind` is position, bearing or range; the global sensor always reads positions.

    noise: std of a reading [m; rad for bearings]; growth: variance grows by 1 + growth d^4; ahead_m: the disc of view
    lies that far in front of the robot, away from the global sensor; planned_range_m: range for the planner.
    """

    name: str
    kind: str = "position"
    range_m: float = 0.5
    noise: float = 0.02
    growth: float = 0.0
    ahead_m: float = 0.0

    @property
    def planned_range_m(self) -> float:
        """Return the range for the planner, with a tenth as margin."""
        return 0.9 * min(self.range_m, 100.0)


SENSORS = (
    PlanarSensor("range 0.3 m", range_m=0.3),
    PlanarSensor("range 0.5 m"),
    PlanarSensor("range 0.8 m", range_m=0.8),
    PlanarSensor("unlimited", range_m=math.inf),
    PlanarSensor("growing noise", range_m=math.inf, growth=625.0),
    PlanarSensor("bearing only", kind="bearing", range_m=0.8, noise=0.05),
    PlanarSensor("range only", kind="range", range_m=0.8),
    PlanarSensor("displaced disc", range_m=0.5, noise=0.03, growth=25.0, ahead_m=0.2),
)
_STEPS = 60
_START_M, _SPEED_M_S = 0.95, 0.02
_GPS_RANGE_M = 0.5


def radial_compositions(robots: int) -> IntArray:
    """Return all topologies whose levels follow the distance to the global sensor (2^(n - 1), n)."""
    rows = []
    for cuts in range(2 ** (robots - 1)):
        steps = [(cuts >> k) & 1 for k in range(robots - 1)]
        rows.append([0, *np.cumsum(steps).tolist()])
    return np.array(rows, dtype=np.int64)


def reading_model(sensor: PlanarSensor, offset: Array, ahead: Array) -> tuple[Array, Array, Array] | None:
    """Return (reading, Jacobian (k, 2), covariance (k, k)) of an offset [m], or None when it is out of view."""
    distance = float(np.hypot(*(offset - sensor.ahead_m * ahead)))
    if distance > sensor.range_m:
        return None
    variance = sensor.noise**2 * (1.0 + sensor.growth * distance**4)
    square = float(offset @ offset) + 1e-6
    if sensor.kind == "bearing":
        jacobian = np.array([[-offset[1], offset[0]]]) / square
        return np.array([math.atan2(offset[1], offset[0])]), jacobian, variance * np.eye(1)
    if sensor.kind == "range":
        return np.array([math.sqrt(square)]), offset[None] / math.sqrt(square), variance * np.eye(1)
    return offset, np.eye(2), variance * np.eye(2)


def run_sensor(sensor: PlanarSensor, level: IntArray, seed: int) -> dict[str, Any]:
    """Return mean trace [m^2], RMSE [m] and readings per step of a team on a fixed topology, target receding."""
    robots, generator = len(level), np.random.default_rng([seed, len(level)])
    parameters = replace(
        FIGURE_1,
        range_m=sensor.planned_range_m,
        sigma_m=sensor.noise if sensor.kind == "position" else FIGURE_1.sigma_m,
    )
    planner = PlanarPlanner(robots, parameters, SearchOptions(mode=SearchMode.FIXED))
    path, dt = receding(_START_M, _SPEED_M_S), parameters.step_s
    place = np.linspace(0.0, _START_M, robots + 2)[1:-1]
    truth = np.vstack([np.column_stack([place, 0.0 * place]) + generator.normal(0.0, 0.05, (robots, 2)), path(0.0)])
    mean, covariance = truth.copy(), 1e-3 * np.eye(2 * robots + 2)
    noise = np.repeat(parameters.process_variance(robots), 2)
    traces, errors, readings = [], [], 0
    for k in range(_STEPS):
        isotropic = 0.5 * (covariance[0::2, 0::2] + covariance[1::2, 1::2])
        velocity = planner.plan(mean, isotropic, level).velocity_m_s[0]
        truth[:-1] += dt * velocity + generator.normal(0.0, np.sqrt(noise[0]), (robots, 2))
        truth[-1] = path((k + 1) * dt)
        mean[:-1] += dt * velocity
        covariance = covariance + np.diag(noise)
        mean, covariance, seen = _fuse(sensor, level, truth, mean, covariance, generator)
        readings += seen
        traces.append(float(np.trace(covariance[-2:, -2:])))
        errors.append(float(np.hypot(*(mean[-1] - truth[-1]))))
    rmse = float(np.sqrt(np.mean(np.square(errors))))
    return {"mean_trace_m2": float(np.mean(traces)), "rmse_m": rmse, "readings_per_step": readings / _STEPS}


def _fuse(
    sensor: PlanarSensor, level: IntArray, truth: Array, mean: Array, covariance: Array, generator: np.random.Generator
) -> tuple[Array, Array, int]:
    """Fuse one reading for each edge in view; the truth decides on the view and the noise."""
    gps = replace(sensor, kind="position", range_m=_GPS_RANGE_M, noise=FIGURE_1.sigma_m, growth=0.0, ahead_m=0.0)
    seen = 0
    for observer, subject in edges_of(level):
        own = gps if observer < 0 else sensor
        origin = truth[observer] if observer >= 0 else np.zeros(2)
        ahead = origin / max(float(np.hypot(*origin)), 1e-9)
        actual = reading_model(own, truth[subject] - origin, ahead)
        draw = generator.normal(0.0, 1.0, 2)
        if actual is None:
            continue
        believed = mean[subject] - (mean[observer] if observer >= 0 else 0.0)
        model = reading_model(replace(own, range_m=math.inf), believed, ahead)
        assert model is not None
        residual = actual[0] + np.sqrt(np.diag(actual[2])) * draw[: len(actual[0])] - model[0]
        if own.kind == "bearing":
            residual = np.remainder(residual + math.pi, 2.0 * math.pi) - math.pi
        difference = np.zeros((2, len(covariance)))
        difference[:, 2 * subject : 2 * subject + 2] = np.eye(2)
        if observer >= 0:
            difference[:, 2 * observer : 2 * observer + 2] = -np.eye(2)
        h = model[1] @ difference
        noise = actual[2] + np.eye(len(residual)) * _curvature(own, believed, difference @ covariance @ difference.T)
        gain = np.linalg.solve(h @ covariance @ h.T + noise, h @ covariance).T
        keep = np.eye(len(covariance)) - gain @ h
        covariance = keep @ covariance @ keep.T + gain @ noise @ gain.T
        mean = mean + (gain @ residual).reshape(-1, 2)
        seen += 1
    return mean, covariance, seen


def _curvature(sensor: PlanarSensor, offset: Array, relative: Array) -> float:
    """Return the variance that the second derivative of a bearing or range adds where the offset is uncertain.

    Without it, robots close to their subjects make the filter certain of a wrong position.
    """
    if sensor.kind == "position":
        return 0.0
    square = float(offset @ offset) + 1e-6
    ratio = float(np.trace(relative)) / square
    return 0.5 * ratio**2 * (1.0 if sensor.kind == "bearing" else square)


def compare(robots: int, seeds: Sequence[int], sensors: Sequence[PlanarSensor] = SENSORS) -> list[dict[str, Any]]:
    """Return one row per sensor and radial topology, cheapest first within a sensor; `wins` marks the best.

    cost: mean trace over seeds [m^2]; levels: sizes from the global sensor outwards, as `2-3`.
    """
    rows: list[dict[str, Any]] = []
    for sensor in sensors:
        own: list[dict[str, Any]] = []
        for level in radial_compositions(robots):
            runs = [run_sensor(sensor, level, seed) for seed in seeds]
            merits = {key: float(np.mean([run[key] for run in runs])) for key in runs[0]}
            sizes = "-".join(str(size) for size in np.bincount(level))
            own.append({"sensor": sensor.name, "levels": sizes, "seeds": len(seeds), **merits})
        own.sort(key=lambda row: row["mean_trace_m2"])
        rows += [{**row, "wins": k == 0} for k, row in enumerate(own)]
    return rows
