"""Figures of a tracked target from its errors at an even rate: when it was found, errors and losses since then."""

from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array, BoolArray

FOUND_M, LOST_M = 0.3, 0.5


@dataclass(frozen=True, slots=True)
class TrackingFigures:
    """Tracking figures of one target.

    found_s: when its error was first below 0.3 m, after the first value; the rest counts from then on. rmse_m, worst_m:
    its error, 1 m where it is unknown; kept_rmse_m: rms of the errors that are no loss; lost_s, longest_loss_s: with an
    error above 0.5 m, all together and in one piece.
    """

    found_s: float
    rmse_m: float
    worst_m: float
    kept_rmse_m: float
    lost_s: float
    longest_loss_s: float


def tracking_figures(errors_m: Array, period_s: float) -> TrackingFigures | None:
    """Return the figures of errors (n), unknown ones not finite; None where the target was never found."""
    known = np.where(np.isfinite(errors_m), errors_m, 2.0 * LOST_M)
    near = np.flatnonzero(np.isfinite(errors_m) & (known < FOUND_M))
    if not near.size:
        return None
    since = known[near[0] :]
    lost = since > LOST_M
    return TrackingFigures(
        found_s=float(near[0]) * period_s,
        rmse_m=float(np.sqrt(np.mean(since**2))),
        worst_m=float(since.max()),
        kept_rmse_m=float(np.sqrt(np.mean(since[~lost] ** 2))),
        lost_s=float(lost.sum()) * period_s,
        longest_loss_s=_longest(lost) * period_s,
    )


def _longest(lost: BoolArray) -> int:
    longest = run = 0
    for now in lost.tolist():
        run = run + 1 if now else 0
        longest = max(longest, run)
    return longest
