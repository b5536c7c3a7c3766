"""Errors of the estimates against the truth, and the belief's uncertainty at the same times."""

import msgspec
import numpy as np

from groundstation.arrays import Array
from groundstation.estimation.tracking_errors import LOST_M
from groundstation.report.tracks import EstimateTrack, TruthTrack

RATE_HZ = 10.0
STALE_S = 0.5
MISSING_ERROR_M = 1.0


class Accuracy(msgspec.Struct, frozen=True):
    """Accuracy of one entity's estimates over an interval.

    rmse_m, max_error_m, lost_s (error > 0.5 m) count a missing or stale estimate as 1 m; covered: share of time with
    an estimate; anees: mean normalised squared error over its dimension (1 = right covariance, > 1 = overconfident);
    judged: share of the interval for which the truth is known; all other figures are of that part.
    """

    rmse_m: float
    max_error_m: float
    lost_s: float
    covered: float
    anees: float | None = None
    yaw_rmse_rad: float | None = None
    judged: float = 1.0


def time_grid(start_s: float, end_s: float) -> Array:
    """Return the times at which errors are computed (10 Hz); at least one."""
    return start_s + np.arange(max(1, int(np.floor((end_s - start_s) * RATE_HZ + 1e-6)))) / RATE_HZ


def errors_at(time_s: Array, truth: TruthTrack, estimate: EstimateTrack | None, dim: int) -> Array:
    """Return position errors (m, dim) [m; world]; NaN without a truth or an estimate younger than 0.5 s."""
    errors = np.full((len(time_s), dim), np.nan)
    if estimate is None or len(estimate.time_s) == 0:
        return errors
    index = estimate.latest_at(time_s, STALE_S)
    known = index >= 0
    errors[known] = estimate.mean[index[known], :dim] - truth.position_at(time_s[known])[:, :dim]
    return errors


def accuracy(time_s: Array, truth: TruthTrack, estimate: EstimateTrack | None, dim: int) -> Accuracy | None:
    """Return the figures over the given times; dim is 2 for targets on the floor, 3 for robots.

    None if the truth is known at none of them.
    """
    asked, time_s = len(time_s), time_s[truth.known_at(time_s)]
    if not len(time_s):
        return None
    errors = errors_at(time_s, truth, estimate, dim)
    distances = np.linalg.norm(errors, axis=1)
    known = np.isfinite(distances)
    counted = np.where(known, distances, MISSING_ERROR_M)
    return Accuracy(
        rmse_m=float(np.sqrt(np.mean(counted**2))),
        max_error_m=float(counted.max()),
        lost_s=float(np.count_nonzero(counted > LOST_M) / RATE_HZ),
        covered=float(np.mean(known)),
        anees=_anees(time_s[known], errors[known], estimate, dim),
        yaw_rmse_rad=_yaw_rmse(time_s[known], truth, estimate) if dim == 3 else None,
        judged=len(time_s) / asked,
    )


def _anees(time_s: Array, errors: Array, estimate: EstimateTrack | None, dim: int) -> float | None:
    if estimate is None or len(time_s) == 0:
        return None
    covariance = estimate.covariance[estimate.latest_at(time_s, STALE_S), :dim, :dim]
    try:
        solved = np.linalg.solve(covariance, errors[:, :, None])[:, :, 0]
    except np.linalg.LinAlgError:
        return None
    return float(np.mean(np.einsum("ij,ij->i", errors, solved)) / dim)


def _yaw_rmse(time_s: Array, truth: TruthTrack, estimate: EstimateTrack | None) -> float | None:
    if estimate is None or len(time_s) == 0 or estimate.mean.shape[1] < 4:
        return None
    difference = estimate.mean[estimate.latest_at(time_s, STALE_S), 3] - truth.yaw_at(time_s)
    wrapped = np.mod(difference + np.pi, 2 * np.pi) - np.pi
    return float(np.sqrt(np.mean(wrapped**2)))
