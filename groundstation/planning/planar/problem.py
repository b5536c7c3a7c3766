"""What the compiled kernels pass around: one control step's problem and its scratch memory."""

from typing import NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from groundstation.planning.planar.lapack import lapack_addresses
from groundstation.planning.planar.parameters import PlanarParameters

Array = NDArray[np.float64]

# The information-form predict loses eps * max(D P) relative accuracy: beyond this the covariance form is used.
STABLE_ABOVE = 1e6


class Problem(NamedTuple):
    """Belief and constants of one control step.

    mean (n + 1, 2) [m; target last]; information (n + 1, n + 1): (P + Q)^-1 per axis, shared by all topologies;
    variance (n + 1): Q; constants: see PlanarParameters.packed; segments: controls held over the horizon;
    stable: predict through the covariance; addresses: LAPACK.
    """

    mean: Array
    information: Array
    variance: Array
    constants: Array
    steps: int
    segments: int
    stable: bool
    addresses: NDArray[np.int64]


class Workspace(NamedTuple):
    """Scratch arrays of the kernels, sized for n robots and h steps."""

    prior: Array
    factor: Array
    square: Array
    columns: Array
    carried: Array
    edges: NDArray[np.int64]
    distance: Array
    weights: Array
    exponent: Array
    position: Array
    step_gradient: Array
    integers: NDArray[np.int32]


_f1, _f2, _f3 = types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1]
PROBLEM = types.NamedTuple(
    [_f2, _f2, _f1, _f1, types.int64, types.int64, types.boolean, types.int64[::1]],
    Problem,
)
WORKSPACE = types.NamedTuple(
    [_f3, _f3, _f2, _f3, _f2, types.int64[:, ::1], _f2, _f2, _f1, _f3, _f3, types.int32[::1]],
    Workspace,
)


def make_workspace(robots: int, steps: int) -> Workspace:
    """Return scratch memory; edges of n robots never exceed those of two equal levels, n^2 / 4 + n + 1."""
    size = robots + 1
    edges = robots * robots // 4 + robots + 2
    return Workspace(
        prior=np.empty((steps, size, size)),
        factor=np.empty((steps, size, size)),
        square=np.empty((size, size)),
        columns=np.empty((steps, steps, size)),
        carried=np.empty((steps, size)),
        edges=np.empty((edges, 2), dtype=np.int64),
        distance=np.empty((steps, edges)),
        weights=np.empty((steps, edges)),
        exponent=np.empty(edges),
        position=np.empty((steps, size, 2)),
        step_gradient=np.empty((steps, robots, 2)),
        integers=np.zeros(4, dtype=np.int32),
    )


def make_problem(mean: Array, covariance: Array, parameters: PlanarParameters, segments: int = 1) -> Problem:
    """Return the problem of one belief: mean (n + 1, 2), per-axis covariance (n + 1, n + 1), target last.

    Raises ValueError for wrong shapes, numbers that are not finite, or a covariance that is not positive definite.
    """
    from groundstation.planning.planar.rollout import predicted_information

    mean, covariance = np.ascontiguousarray(mean, float), np.ascontiguousarray(covariance, float)
    size = len(mean)
    if size < 2 or mean.shape != (size, 2) or covariance.shape != (size, size):
        raise ValueError(f"need mean (n + 1, 2) and covariance (n + 1, n + 1), got {mean.shape}, {covariance.shape}")
    if not (np.isfinite(mean).all() and np.isfinite(covariance).all()):
        raise ValueError("mean and covariance must be finite")
    if not np.allclose(covariance, covariance.T, rtol=1e-9, atol=1e-12 * np.abs(covariance).max()):
        raise ValueError("covariance is not symmetric")
    if not 1 <= segments <= parameters.steps:
        raise ValueError(f"segments must lie in 1..{parameters.steps} (got {segments})")
    variance, addresses = parameters.process_variance(size - 1), lapack_addresses()
    if np.diagonal(covariance).min() < 0 or np.linalg.eigvalsh(covariance).min() < -1e-9 * np.trace(covariance):
        raise ValueError("covariance is not positive semidefinite")
    information = np.empty((size, size))
    if not predicted_information(covariance, variance, information, addresses, np.zeros(4, np.int32)):
        raise ValueError("covariance plus process noise is not positive definite")
    stable = bool((np.diagonal(covariance) / variance).max() > STABLE_ABOVE)
    packed = parameters.packed()
    return Problem(mean, information, variance, packed, parameters.steps, segments, stable, addresses)
