"""Seeded beliefs for benchmarks and tests: teams strung out between the global sensor and the target."""

import numpy as np
from numpy.typing import NDArray

from groundstation.arrays import Array
from groundstation.experiments.planar.parameters import PlanarParameters

LAYOUTS = ("two-level", "random", "string", "flat")
_SPACING_M = 0.35
_SCATTER_M = 0.06
_FILTER_STEPS = 30
_FIRST_M2 = 1e-2


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
    ends = np.append(level, level.max() + 1)
    offset, permitted = mean[None, :, :] - mean[:, None, :], ends[None, :] == ends[:, None] + 1
    weights = _weights(offset, parameters) * permitted
    fixed = _weights(mean, parameters) * (ends == 0)
    readings = np.diag(fixed + weights.sum(axis=0) + weights.sum(axis=1)) - weights - weights.T
    covariance = _FIRST_M2 * np.eye(size)
    variance = np.diag(parameters.process_variance(size - 1))
    for _ in range(_FILTER_STEPS):
        covariance = np.linalg.inv(np.linalg.inv(covariance + variance) + readings)
    return 0.5 * (covariance + covariance.T)


def _weights(offset: Array, parameters: PlanarParameters) -> Array:
    distance = np.hypot(np.hypot(offset[..., 0], offset[..., 1]), parameters.epsilon_m)
    exponent = np.minimum((distance - parameters.range_m) / parameters.softness_m, 40.0)
    return np.asarray(1.0 / (parameters.sigma_m**2 * (1.0 + np.exp(exponent))))


def bench_belief(
    robots: int, layout: str, seed: int, parameters: PlanarParameters
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Return (mean, per-axis covariance, level vector) of a settled team; the same for the same arguments."""
    generator = np.random.default_rng([seed, robots, LAYOUTS.index(layout) if layout in LAYOUTS else 0])
    level = layout_levels(layout, robots, generator)
    mean = place(level, generator)
    return mean, settled_covariance(mean, level, parameters), level


def scattered_belief(
    robots: int, generator: np.random.Generator, parameters: PlanarParameters
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Return (mean, per-axis covariance, level vector) of a team without order, which a planner must handle too.

    Positions fill a disc of random size, levels are random, and variances span six decades with random correlation.
    """
    size = robots + 1
    mean = generator.normal(0.0, generator.uniform(0.05, 1.0), (size, 2))
    level = np.unique(generator.integers(0, generator.integers(1, robots + 1), robots), return_inverse=True)[1]
    if generator.random() < 0.5:
        return mean, settled_covariance(mean, level, parameters), level.astype(np.int64)
    mixing = generator.normal(size=(size, size)) / np.sqrt(size) + generator.uniform(0.1, 3.0) * np.eye(size)
    scale = 10.0 ** generator.uniform(-3.0, 0.0, size)
    factor = scale[:, None] * mixing
    return mean, factor @ factor.T, level.astype(np.int64)
