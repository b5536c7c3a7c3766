"""Which figures of a field does a recording show to be wrong? As few causes as explain it. Pure arrays.

All figures are free within their surveys. One cause after another is let loose, the one that raises the evidence of
the linear Gaussian model most, until none raises it enough.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array, Vector
from groundstation.calibration.team_figures import Suspicion

# By how much (log) a cause must raise the evidence; causes this much worse than the best are ruled out.
SURE, _RULED_OUT = math.log(1e4), math.log(20.0)
_MOST = 8


@dataclass(frozen=True, slots=True)
class Cause:
    """Something that is wrong, by how much (log) it raises the evidence, and what would explain it nearly as well."""

    suspicion: Suspicion
    gain: float
    rivals: tuple[Suspicion, ...]


def causes(
    H: Array, g: Vector, surveyed: Vector, suspicions: Iterable[Suspicion], sure: float = SURE
) -> tuple[tuple[Cause, ...], Array]:
    """Return what is wrong, gravest first, and the prior's covariance (n, n) that goes with it.

    H (n, n), g (n): information and pull. sure: by how much (log) each cause must raise the evidence.
    """
    sigma, left, found = np.diag(surveyed**2), list(suspicions), list[Cause]()
    here = evidence(H, g, sigma)
    while left and len(found) < _MOST:
        tried = [evidence(H, g, sigma + spread(s)) - here for s in left]
        best = int(np.argmax(tried))
        if tried[best] < sure:
            break
        rivals = [
            s for s, gain in zip(left, tried, strict=True) if gain > tried[best] - _RULED_OUT and s is not left[best]
        ]
        found.append(Cause(left[best], tried[best], tuple(rivals)))
        sigma = sigma + spread(left.pop(best))
        here = evidence(H, g, sigma)
    return tuple(found), sigma


def spread(s: Suspicion) -> Array:
    """Return what a suspicion adds to the covariance (n, n) of the figures' errors."""
    return np.asarray((s.directions * s.sigma**2) @ s.directions.T)


def evidence(H: Array, g: Vector, sigma: Array) -> float:
    """Return the log evidence, but for a constant, of errors with covariance sigma about zero."""
    inner = np.eye(len(g)) + sigma @ H
    return 0.5 * float(g @ np.linalg.solve(inner, sigma @ g) - np.linalg.slogdet(inner)[1])


def posterior(H: Array, g: Vector, sigma: Array) -> tuple[Vector, Array]:
    """Return mean and covariance of the errors."""
    inner = np.eye(len(g)) + sigma @ H
    covariance = np.linalg.solve(inner, sigma)
    return np.asarray(np.linalg.solve(inner, sigma @ g)), np.asarray(0.5 * (covariance + covariance.T))


def freed(found: Sequence[Cause]) -> Array:
    """Return which figures (n) any cause moves; empty for no cause."""
    return np.any(np.hstack([one.suspicion.directions for one in found]) != 0.0, axis=1) if found else np.zeros(0, bool)
