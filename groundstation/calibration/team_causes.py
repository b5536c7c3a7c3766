"""Which figures of a field does a recording show to be wrong? As few causes as explain it. Pure arrays.

All figures are free within their surveys. One cause after another is let loose, the one that raises the evidence of
the linear Gaussian model most, until none raises it enough.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from groundstation.arrays import Array, Vector
from groundstation.calibration.team_figures import Suspicion

# By how much (log) a cause must raise the evidence; causes this much worse than the best are ruled out.
_SURE, RULED_OUT = math.log(1e4), math.log(20.0)
_MOST = 8


@dataclass(frozen=True, slots=True)
class Cause:
    """Something that is wrong, by how much (log) it raises the evidence, and what would explain it nearly as well."""

    suspicion: Suspicion
    gain: float
    rivals: tuple[Suspicion, ...]


@dataclass(frozen=True, slots=True)
class Round:
    """What lets each suspicion explain more: sigma (n, n): the prior so far; gains (log): of those that are left."""

    sigma: Array
    gains: tuple[tuple[Suspicion, float], ...]

    @property
    def best(self) -> tuple[Suspicion, float]:
        """Return the suspicion that explains most, and its gain."""
        return max(self.gains, key=lambda one: one[1])

    @property
    def near(self) -> tuple[tuple[Suspicion, float], ...]:
        """Return the best and those that are not ruled out beside it."""
        least = self.best[1] - RULED_OUT
        return tuple(one for one in self.gains if one[1] > least)


def rounds(H: Array, g: Vector, surveyed: Vector, suspicions: Iterable[Suspicion]) -> Iterator[Round]:
    """Yield one round after another; in each the best is let loose for those that follow.

    H (n, n), g (n): information and pull on figures that were surveyed to one sigma (n).
    """
    sigma, left = np.diag(surveyed**2), list(suspicions)
    while left:
        here = evidence(H, g, sigma)
        one = Round(sigma, tuple((s, evidence(H, g, sigma + spread(s)) - here) for s in left))
        yield one
        best, _ = one.best
        left = [s for s in left if s is not best]
        sigma = sigma + spread(best)


def causes(H: Array, g: Vector, surveyed: Vector, suspicions: Iterable[Suspicion]) -> tuple[tuple[Cause, ...], Array]:
    """Return what is wrong, gravest first, and the prior's covariance (n, n) that goes with it."""
    sigma, found = np.diag(surveyed**2), list[Cause]()
    for one in islice(rounds(H, g, surveyed, suspicions), _MOST):
        best, gain = one.best
        if gain < _SURE:
            break
        found.append(Cause(best, gain, tuple(s for s, _ in one.near if s is not best)))
        sigma = one.sigma + spread(best)
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
