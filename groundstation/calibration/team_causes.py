"""Finds the figures of a field that a recording shows to be wrong: as few causes as explain it. Pure arrays.

All figures are free within their surveys. One cause after another is freed, always the one that raises the evidence
most, until none raises it enough. A linear Gaussian model selects the candidates for a trial; the decision is by the
gain of a fit with the cause over one without it.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from groundstation.arrays import Array, Vector
from groundstation.calibration.team_figures import Suspicion

# Gain (log) in evidence that a cause needs; causes worse than the best by this much are ruled out.
_SURE, RULED_OUT = math.log(100.0), math.log(20.0)
# Velocity errors are the least known: noise that happened to look like a delay raised the evidence by e^8 in a healthy
# flight.
_SURE_OF = {"velocity_delay": math.log(1e4)}
# Causes with a smaller lead in the linear model are not tried; of the others, this many at once.
_WORTH_A_TRIAL, _AT_ONCE = math.log(10.0), 4
_MOST = 8


class Explained(Protocol):
    """A recording fitted under a prior: information (n, n) and pull (n) of the recording alone."""

    @property
    def information(self) -> Array:
        """Return the information on the figures."""

    @property
    def pull(self) -> Vector:
        """Return the pull on the figures, about zero."""

    def log_evidence(self, sigma: Array) -> float:
        """Return the log evidence, but for a constant, of the fit's prior (n, n)."""


Explain = Callable[[Array], Explained]
"""Fits a recording if the figures' errors have a prior with this covariance (n, n)."""


@dataclass(frozen=True, slots=True)
class Trial:
    """A suspicion, the fit with it, and its gain (log) over the fit without."""

    suspicion: Suspicion
    explained: Explained
    lead: float


@dataclass(frozen=True, slots=True)
class Cause:
    """A cause, its gain (log) in evidence, and the suspicions that explain the data nearly as well."""

    suspicion: Suspicion
    gain: float
    rivals: tuple[Suspicion, ...]


@dataclass(frozen=True, slots=True)
class Round:
    """One round of the linear model: sigma (n, n): the prior so far; gains (log): of the remaining suspicions."""

    sigma: Array
    gains: tuple[tuple[Suspicion, float], ...]

    @property
    def best(self) -> tuple[Suspicion, float]:
        """Return the suspicion with the largest gain, and that gain."""
        return max(self.gains, key=lambda one: one[1])

    @property
    def near(self) -> tuple[tuple[Suspicion, float], ...]:
        """Return the best suspicion and those that are not ruled out beside it."""
        least = self.best[1] - RULED_OUT
        return tuple(one for one in self.gains if one[1] > least)


def round_of(H: Array, g: Vector, sigma: Array, suspicions: Iterable[Suspicion]) -> Round:
    """Return the gain of each suspicion beyond what has been freed already.

    H (n, n), g (n): information and pull on figures whose errors have the prior sigma (n, n).
    """
    here = evidence(H, g, sigma)
    return Round(sigma, tuple((s, evidence(H, g, sigma + spread(s)) - here) for s in suspicions))


def rounds(H: Array, g: Vector, surveyed: Vector, suspicions: Iterable[Suspicion]) -> Iterator[Round]:
    """Yield round after round; the best of each is freed for those that follow; surveyed (n): one sigma."""
    sigma, left = np.diag(surveyed**2), list(suspicions)
    while left:
        one = round_of(H, g, sigma, left)
        yield one
        best, _ = one.best
        left = [s for s in left if s is not best]
        sigma = sigma + spread(best)


def sure_of(what: str) -> float:
    """Return the gain (log) in evidence that a cause of this sort needs."""
    return _SURE_OF.get(what, _SURE)


def tried(explain: Explain, sigma: Array, suspicions: Iterable[Suspicion], without: float) -> list[Trial]:
    """Return a trial of each suspicion, best first; without: the log evidence of sigma (n, n) without any."""
    found = []
    for s in suspicions:
        freed_too = sigma + spread(s)
        explained = explain(freed_too)
        found.append(Trial(s, explained, explained.log_evidence(freed_too) - without))
    return sorted(found, key=lambda trial: -trial.lead)


def causes(
    explain: Explain, free: Explained, surveyed: Vector, suspicions: Iterable[Suspicion]
) -> tuple[tuple[Cause, ...], Array]:
    """Return the causes, gravest first, and the prior's covariance (n, n) that includes them.

    free: the recording with all figures in doubt, by which the linear model chooses the trials; surveyed (n): one
    sigma.
    """
    sigma, left, found = np.diag(surveyed**2), list(suspicions), list[Cause]()
    without = math.nan
    while left and len(found) < _MOST:
        one = round_of(free.information, free.pull, sigma, left)
        if one.best[1] < _WORTH_A_TRIAL:
            break
        if not found:
            without = explain(sigma).log_evidence(sigma)
        likely = [s for s, _ in sorted(one.near, key=lambda pair: -pair[1])[:_AT_ONCE]]
        best, *others = tried(explain, sigma, likely, without)
        if best.lead < sure_of(best.suspicion.what):
            break
        rivals = tuple(other.suspicion for other in others if other.lead > best.lead - RULED_OUT)
        found.append(Cause(best.suspicion, best.lead, rivals))
        left = [s for s in left if s is not best.suspicion]
        sigma, without = sigma + spread(best.suspicion), without + best.lead
    return tuple(found), sigma


def spread(s: Suspicion) -> Array:
    """Return the part (n, n) of a suspicion in the covariance of the figures' errors."""
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
    """Return for each figure (n) whether any cause moves it; empty for no cause."""
    return np.any(np.hstack([one.suspicion.directions for one in found]) != 0.0, axis=1) if found else np.zeros(0, bool)
