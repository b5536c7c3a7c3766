"""Seeded beliefs for benchmarks and tests: teams strung out between the global sensor and the target."""

import numpy as np
from numpy.typing import NDArray

from groundstation.planning.planar.parameters import PlanarParameters

Array = NDArray[np.float64]
LAYOUTS = ("two-level", "random", "string", "flat")
_SPACING_M = 0.35
_SCATTER_M = 0.06
_FILTER_STEPS = 30


def layout_levels(layout: str, robots: int, generator: np.random.Generator) -> NDArray[np.int64]:
    """Return a level vector: two equal levels, about sqrt(n) random ones, one robot each, or a single one.

    Raises ValueError for an unknown layout.
    """
    if layout == "string":
        return np.arange(robots, dtype=np.int64)
    if layout == "flat":
        return np.zeros(robots, dtype=np.int64)
    if layout == "two-level":
        return (np.arange(robots) >= (robots + 1) // 2).astype(np.int64)
    if layout != "random":
        raise ValueError(f"unknown layout {layout!r}: choose one of {', '.join(LAYOUTS)}")
    count = max(1, round(np.sqrt(robots)))
    level = generator.integers(0, count, robots)
    return np.unique(level, return_inverse=True)[1].astype(np.int64)


def place(level: NDArray[np.int64], generator: np.random.Generator) -> Array:
    """Return positions (n + 1, 2) [m]: each level one spacing further out on a ray, the target beyond the last."""
    angle = generator.uniform(-np.pi, np.pi)
    along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    distance = _SPACING_M * (np.append(level, level.max() + 1) + 1.0)
    scatter = generator.normal(0.0, _SCATTER_M, (len(distance), 2))
    return np.outer(distance + scatter[:, 0], along) + np.outer(scatter[:, 1], across)


def settled_covariance(mean: Array, level: NDArray[np.int64], parameters: PlanarParameters) -> Array:
    """Return the per-axis covariance (n + 1, n + 1) [m^2] that a filter on this topology settles to."""
    size = len(mean)
    covariance = 1e-2 * np.eye(size)
    variance = np.diag(parameters.process_variance(size - 1))
    ends = np.append(level, level.max() + 1)
    for _ in range(_FILTER_STEPS):
        information = np.linalg.inv(covariance + variance)
        for b in range(size):
            observers = [-1] if ends[b] == 0 else list(np.flatnonzero(ends == ends[b] - 1))
            for a in observers:
                row = np.zeros(size)
                row[b] = 1.0
                if a >= 0:
                    row[a] = -1.0
                information += _weight(row @ mean, parameters) * np.outer(row, row)
        covariance = np.linalg.inv(information)
    return 0.5 * (covariance + covariance.T)


def _weight(offset: Array, parameters: PlanarParameters) -> float:
    distance = np.hypot(np.hypot(*offset), parameters.epsilon_m)
    exponent = min((distance - parameters.range_m) / parameters.softness_m, 40.0)
    return float(1.0 / (parameters.sigma_m**2 * (1.0 + np.exp(exponent))))


def bench_belief(
    robots: int, layout: str, seed: int, parameters: PlanarParameters
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Return (mean, per-axis covariance, level vector) of a settled team; the same for the same arguments."""
    generator = np.random.default_rng([seed, robots, LAYOUTS.index(layout) if layout in LAYOUTS else 0])
    level = layout_levels(layout, robots, generator)
    mean = place(level, generator)
    return mean, settled_covariance(mean, level, parameters), level
