"""The filter's consistency: NEES against the truth, NIS of fused observations, with chi-square bounds."""

from collections import defaultdict

import msgspec
import numpy as np
from scipy.stats import chi2

from groundstation.arrays import Array
from groundstation.bus.messages import Innovation, Verdict
from groundstation.report.accuracy import STALE_S
from groundstation.report.tracks import EstimateTrack, RunData, TimedMessage, TruthTrack

CONFIDENCE = 0.95
WINDOW_S = 1.0
_FUSED = (Verdict.ACCEPTED, Verdict.INFLATED)


class EdgeConsistency(msgspec.Struct, frozen=True):
    """Of one observer and subject: NIS per degree of freedom with two-sided bounds, and counts of other verdicts.

    The bounds hold for independent innovations; correlated errors widen the scatter of the mean.
    """

    observer: str
    subject: str
    count: int
    nis_per_dof: float | None
    low: float | None
    high: float | None
    inflated_percent: float
    refused: dict[str, int]
    latency_p50_ms: float
    latency_p99_ms: float


def bounds(dof: int) -> tuple[float, float]:
    """Return the two-sided 95 % bounds of a chi-square sum of `dof` degrees of freedom, per degree of freedom."""
    low, high = chi2.ppf([(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2], dof)
    return float(low / dof), float(high / dof)


def edges(data: RunData) -> list[EdgeConsistency]:
    """Return each observer-subject pair with observations, in order of names."""
    pairs: defaultdict[tuple[str, str], list[Innovation]] = defaultdict(list)
    for item in data.innovations:
        pairs[item.message.observer, item.message.subject].append(item.message)
    return [_edge(observer, subject, found) for (observer, subject), found in sorted(pairs.items())]


def _edge(observer: str, subject: str, found: list[Innovation]) -> EdgeConsistency:
    fused = [innovation for innovation in found if innovation.verdict in _FUSED]
    accepted = [innovation for innovation in fused if _counts(innovation)]
    refused: defaultdict[str, int] = defaultdict(int)
    for innovation in found:
        if innovation.verdict not in _FUSED:
            refused[str(innovation.verdict)] += 1
    dof = sum(len(innovation.residual) for innovation in accepted)
    low, high = bounds(dof) if dof else (None, None)
    inflated = sum(innovation.verdict is Verdict.INFLATED for innovation in fused)
    latency = np.percentile([innovation.latency_ms for innovation in found], [50, 99])
    return EdgeConsistency(
        observer=observer,
        subject=subject,
        count=len(found),
        nis_per_dof=sum(innovation.nis or 0.0 for innovation in accepted) / dof if dof else None,
        low=low,
        high=high,
        inflated_percent=100.0 * inflated / max(1, len(fused)),
        refused=dict(refused),
        latency_p50_ms=float(latency[0]),
        latency_p99_ms=float(latency[1]),
    )


def _counts(innovation: Innovation) -> bool:
    """Return whether its NIS counts; outliers, which were fused with inflated noise, are counted separately."""
    return innovation.nis is not None and innovation.verdict is Verdict.ACCEPTED


def nees_per_dof(time_s: Array, truth: TruthTrack, estimate: EstimateTrack) -> Array:
    """Return NEES per degree of freedom (m) over (x, y, z, yaw) of a robot or (x, y) of a target; NaN where unknown."""
    result = np.full(len(time_s), np.nan)
    index = estimate.latest_at(time_s, STALE_S)
    known = index >= 0
    mean, covariance = estimate.mean[index[known]], estimate.covariance[index[known]]
    errors = mean[:, :2] - truth.position_at(time_s[known])[:, :2]
    if mean.shape[1] == 4:
        turned = np.mod(mean[:, 3] - truth.yaw_at(time_s[known]) + np.pi, 2 * np.pi) - np.pi
        errors = np.column_stack([errors, mean[:, 2] - truth.position_at(time_s[known])[:, 2], turned])
    size = errors.shape[1]
    try:
        solved = np.linalg.solve(covariance[:, :size, :size], errors[:, :, None])[:, :, 0]
    except np.linalg.LinAlgError:
        return result
    result[known] = np.einsum("ij,ij->i", errors, solved) / size
    return result


def windowed_nis(
    innovations: list[TimedMessage[Innovation]], start_s: float, end_s: float
) -> tuple[Array, Array, Array, Array]:
    """Return window middles, NIS per degree of freedom, and its lower and upper bound (all m) in windows of 1 s."""
    windows = max(1, round((end_s - start_s) / WINDOW_S))
    total, dof = np.zeros(windows), np.zeros(windows)
    for item in innovations:
        window = int((item.time_s - start_s) / WINDOW_S)
        if _counts(item.message) and 0 <= window < windows:
            total[window] += item.message.nis or 0.0
            dof[window] += len(item.message.residual)
    kept = np.flatnonzero(dof)
    low, high = (np.asarray(chi2.ppf(p, dof[kept]) / dof[kept]) for p in ((1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2))
    middles: Array = np.asarray(start_s + (kept + 0.5) * WINDOW_S, dtype=np.float64)
    return middles, total[kept] / dof[kept], low, high
