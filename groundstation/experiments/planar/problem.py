"""Arrays for the kernels: one control step's problem and its scratch memory."""

import numpy as np

from groundstation.arrays import Array, IntVector, Matrix, Vector, zeros_on_a_line
from groundstation.experiments.planar.edges import sort_team
from groundstation.experiments.planar.parameters import PlanarParameters
from groundstation.experiments.planar.records import Observers, PlanarProblem, Workspace, X, Y
from groundstation.experiments.planar.rollout import predicted_information
from groundstation.kernel import kernel
from groundstation.planning.dense import cholesky_upper, padded
from groundstation.planning.lanes import LANES

# The information-form predict loses eps * max(D P) relative accuracy: beyond this the covariance form is used.
STABLE_ABOVE = 1e6


def make_workspace(robots: int, steps: int) -> Workspace:
    """Return scratch memory; edges of n robots never exceed those of two equal levels, n^2 / 4 + n + 1."""
    size = robots + 1
    m, edges = padded(size), padded(robots * robots // 4 + robots + 2) + LANES
    prior = zeros_on_a_line((steps, m, m))
    prior[:] = np.eye(m)
    return Workspace(
        order=np.arange(size),
        observers=Observers(*np.zeros((3, robots + 2), dtype=np.uint64)),
        mean=np.zeros((2, m)),
        variance=np.ones(size),
        prior=prior,
        factor=zeros_on_a_line((steps, m, m)),
        square=zeros_on_a_line((m, m)),
        panel=zeros_on_a_line((8, m)),
        columns=zeros_on_a_line((steps, steps + 3, m)),
        slopes=zeros_on_a_line((steps, edges)),
        weights=zeros_on_a_line((steps, edges)),
        scratch=zeros_on_a_line((m + LANES,)),
        position=zeros_on_a_line((steps, 2, m + LANES)),
        gradient=zeros_on_a_line((steps, 2, m + LANES)),
    )


@kernel()
def load_topology(level: IntVector, problem: PlanarProblem, work: Workspace) -> None:
    """Sort the problem's team by the levels of a topology."""
    order, mean, variance, prior = work.order, work.mean, work.variance, work.prior
    sort_team(level, order, work.observers)
    for a in range(order.shape[0]):
        own = order[a]
        mean[X, a], mean[Y, a] = problem.mean[own, X], problem.mean[own, Y]
        variance[a] = problem.variance[own]
        for b in range(order.shape[0]):
            prior[0, a, b] = problem.information[own, order[b]]


@kernel()
def reorder(source: Vector, robots: int, work: Workspace, target: Vector, to_sorted: bool) -> None:
    """Copy controls (segments * n * 2) into, or out of, the sorted order of the workspace's topology."""
    for first in range(0, source.shape[0], 2 * robots):
        for place in range(robots):
            a, b = first + 2 * int(work.order[place]), first + 2 * place
            if not to_sorted:
                a, b = b, a
            target[b], target[b + 1] = source[a], source[a + 1]


FINE, NOT_FINITE, NOT_SYMMETRIC, NOT_PSD = 0, 1, 2, 3


@kernel()
def _judge(mean: Matrix, covariance: Matrix, scratch: Matrix) -> int:
    """Return the fault of a belief; positive semidefinite means to 1e-9 of the trace."""
    size, trace, largest = mean.shape[0], 0.0, 0.0
    for a in range(size):
        trace += covariance[a, a]
        if not (np.isfinite(mean[a, X]) and np.isfinite(mean[a, Y])):
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
    return PlanarProblem(mean, information, variance, parameters.constants(), parameters.steps, segments, stable)
