"""What the compiled kernels pass around: one control step's problem and its scratch memory."""

from typing import NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from groundstation.arrays import Array
from groundstation.experiments.planar.dense import cholesky_upper, padded
from groundstation.experiments.planar.edges import sort_team
from groundstation.experiments.planar.parameters import PlanarParameters
from groundstation.experiments.planar.rollout import predicted_information

# The information-form predict loses eps * max(D P) relative accuracy: beyond this the covariance form is used.
STABLE_ABOVE = 1e6


class PlanarProblem(NamedTuple):
    """Belief and constants of one control step.

    mean (n + 1, 2) [m; target last]; information (m, m): (P + Q)^-1 per axis, shared by all topologies;
    variance (n + 1): Q; constants: see PlanarParameters.packed; segments: controls held over the horizon;
    stable: predict through the covariance.
    """

    mean: Array
    information: Array
    variance: Array
    constants: Array
    steps: int
    segments: int
    stable: bool


class Workspace(NamedTuple):
    """Scratch arrays of the kernels for n robots and h steps, and the topology at hand, its team sorted by level.

    order (n + 1): which entity stands at each sorted place; rows (n + 2, 3): see `sort_team`; mean (2, m) and
    variance (n + 1) in sorted order; all others are filled by the rollout. m: n + 1 padded to the vector width.
    """

    order: NDArray[np.int64]
    rows: NDArray[np.uint64]
    mean: Array
    variance: Array
    prior: Array
    factor: Array
    square: Array
    panel: Array
    columns: Array
    distance: Array
    weights: Array
    scratch: Array
    position: Array
    gradient: Array


_f1, _f2, _f3 = types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1]
_i1, _i8 = types.int64[::1], types.int64
PROBLEM = types.NamedTuple([_f2, _f2, _f1, _f1, _i8, _i8, types.boolean], PlanarProblem)
_u2 = types.uint64[:, ::1]
WORKSPACE = types.NamedTuple([_i1, _u2, _f2, _f1, _f3, _f3, _f2, _f2, _f3, _f2, _f2, _f1, _f3, _f3], Workspace)


def make_workspace(robots: int, steps: int) -> Workspace:
    """Return scratch memory; edges of n robots never exceed those of two equal levels, n^2 / 4 + n + 1."""
    size = robots + 1
    m, edges = padded(size), robots * robots // 4 + robots + 2
    return Workspace(
        order=np.arange(size),
        rows=np.zeros((robots + 2, 3), dtype=np.uint64),
        mean=np.zeros((2, m)),
        variance=np.ones(size),
        prior=np.tile(np.eye(m), (steps, 1, 1)),
        factor=np.zeros((steps, m, m)),
        square=np.zeros((m, m)),
        panel=np.zeros((8, m)),
        columns=np.zeros((steps, steps + 3, m)),
        distance=np.zeros((steps, edges)),
        weights=np.zeros((steps, edges)),
        scratch=np.zeros(max(edges, m)),
        position=np.zeros((steps, 2, m)),
        gradient=np.zeros((steps, 2, m)),
    )


@njit(_i8(_i1, PROBLEM, WORKSPACE), cache=True, nogil=True)
def load_topology(level, problem, work):  # type: ignore[no-untyped-def]
    """Sort the problem's team by the levels of a topology; return the number of its edges."""
    count = sort_team(level, work.order, work.rows)
    for a in range(work.order.shape[0]):
        own = work.order[a]
        work.mean[0, a], work.mean[1, a] = problem.mean[own, 0], problem.mean[own, 1]
        work.variance[a] = problem.variance[own]
        for b in range(work.order.shape[0]):
            work.prior[0, a, b] = problem.information[own, work.order[b]]
    return count


FINE, NOT_FINITE, NOT_SYMMETRIC, NOT_PSD = 0, 1, 2, 3


@njit(_i8(_f2, _f2, _f2), cache=True, nogil=True)
def _judge(mean, covariance, scratch):  # type: ignore[no-untyped-def]
    """Return what is wrong with a belief; positive semidefinite means to 1e-9 of the trace."""
    size, trace, largest = mean.shape[0], 0.0, 0.0
    for a in range(size):
        trace += covariance[a, a]
        if not (np.isfinite(mean[a, 0]) and np.isfinite(mean[a, 1])):
            return NOT_FINITE
        for b in range(size):
            if not np.isfinite(covariance[a, b]):
                return NOT_FINITE
            largest = max(largest, abs(covariance[a, b]))
    for a in range(size):
        for b in range(a):
            difference = abs(covariance[a, b] - covariance[b, a])
            if difference > 1e-12 * largest + 1e-9 * abs(covariance[b, a]):
                return NOT_SYMMETRIC
            scratch[b, a] = covariance[a, b]
        if covariance[a, a] < 0.0:
            return NOT_PSD
        scratch[a, a] = covariance[a, a] + 1e-9 * trace + 1e-300
    for a in range(size, scratch.shape[0]):
        scratch[a, a] = 1.0
    return FINE if cholesky_upper(scratch) else NOT_PSD


_WRONG = {
    NOT_FINITE: "mean and covariance must be finite",
    NOT_SYMMETRIC: "covariance is not symmetric",
    NOT_PSD: "covariance is not positive semidefinite",
}


def make_problem(mean: Array, covariance: Array, parameters: PlanarParameters, segments: int = 1) -> PlanarProblem:
    """Return the problem of one belief: mean (n + 1, 2), per-axis covariance (n + 1, n + 1), target last.

    Raises ValueError for wrong shapes, numbers that are not finite, or a covariance that is not positive definite.
    """
    mean = np.ascontiguousarray(mean, dtype=np.float64)
    covariance = np.ascontiguousarray(covariance, dtype=np.float64)
    size = len(mean)
    if size < 2 or mean.shape != (size, 2) or covariance.shape != (size, size):
        raise ValueError(f"need mean (n + 1, 2) and covariance (n + 1, n + 1), got {mean.shape}, {covariance.shape}")
    if not 1 <= segments <= parameters.steps:
        raise ValueError(f"segments must lie in 1..{parameters.steps} (got {segments})")
    m = padded(size)
    information = np.zeros((m, m))
    verdict = _judge(mean, covariance, information)
    if verdict != FINE:
        raise ValueError(_WRONG[verdict])
    variance = parameters.process_variance(size - 1)
    if not predicted_information(covariance, variance, information, np.zeros((8, m))):
        raise ValueError("covariance plus process noise is not positive definite")
    stable = bool((covariance.diagonal() / variance).max() > STABLE_ABOVE)
    return PlanarProblem(mean, information, variance, parameters.packed(), parameters.steps, segments, stable)
