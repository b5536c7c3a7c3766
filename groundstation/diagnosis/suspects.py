"""Which figures of the field does a stretch of flight show to be wrong? Pure.

All figures and paths are fitted at once, as `calibrate team` does; causes are told on less evidence, because the
operator reads them as suspicions and a flight is short.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array, Vector
from groundstation.calibration.flown import Flown
from groundstation.calibration.team_batch import TeamBatch
from groundstation.calibration.team_causes import evidence, posterior, spread
from groundstation.calibration.team_figures import Suspicion
from groundstation.calibration.team_record import team_record
from groundstation.errors import OperatorMistake
from groundstation.field.resolved import ResolvedField

Suspect = tuple[str, str]
"""One thing that may be wrong: whose ("": of all), and what."""

# By how much (log) a suspect must raise the evidence to be named; rivals this much behind it are ruled out.
_SURE, _RULED_OUT = math.log(100.0), math.log(20.0)
# Less does not harm, and is not told: [m], [rad], [s], shares.
_WORTH_TELLING = {
    "print": 0.02,
    "focal": 0.02,
    "pan": math.radians(1.2),
    "tilt": math.radians(1.5),
    "tilted": math.radians(1.2),
    "yaw": math.radians(2.0),
    "delay": 0.03,
    "scale": 0.16,
    "velocity_delay": 0.04,
    "height_delay": 0.06,
}
_WORTH_TELLING_M = 0.06
# Mean squared deviation of a healthy simulated flight, whose sightings differ at random; where it is more, they share
# what disturbs them.
_USUAL_MISFIT = 0.25
_MOST = 3


@dataclass(frozen=True, slots=True)
class Charge:
    """A suspect with the size of its error, one sigma, and by how much (log) it explains more than nothing does."""

    suspect: Suspect
    size: float
    std: float
    lead: float


@dataclass(frozen=True, slots=True)
class Verdict:
    """causes: of each thing that is wrong the charges that cannot be told apart, likeliest first; leads: of all."""

    causes: tuple[tuple[Charge, ...], ...]
    leads: Mapping[Suspect, float]


def verdict_on(flown: Flown, field: ResolvedField) -> Verdict | None:
    """Return what a stretch of flight shows; None where it has too little, or nothing that fits it was found."""
    try:
        batch = TeamBatch(team_record(flown, field), field)
        fit = batch.fit(np.diag(batch.figures.wide**2))
    except (OperatorMistake, np.linalg.LinAlgError):
        return None
    H, g = fit.if_alike(max(1.0, fit.misfit / _USUAL_MISFIT))
    return weighed(H, g, batch.figures.surveyed, tuple(batch.figures.suspicions()))


def weighed(H: Array, g: Vector, surveyed: Vector, suspicions: Sequence[Suspicion]) -> Verdict:
    """Return the verdict by information (n, n) and pull (n) on figures that were surveyed to one sigma (n)."""
    sigma, left = np.diag(surveyed**2), list(suspicions)
    first: dict[Suspect, float] = {}
    causes: list[tuple[Charge, ...]] = []
    while left and len(causes) < _MOST:
        here = evidence(H, g, sigma)
        charges = sorted((_charge(H, g, sigma, s, here) for s in left), key=lambda one: -one.lead)
        first = first or {one.suspect: one.lead for one in charges}
        best = charges[0]
        if best.lead < _SURE or abs(best.size) < _WORTH_TELLING.get(best.suspect[1], _WORTH_TELLING_M):
            break
        causes.append(tuple(one for one in charges if one.lead > best.lead - _RULED_OUT))
        found = next(s for s in left if (s.who, s.what) == best.suspect)
        left.remove(found)
        sigma = sigma + spread(found)
    return Verdict(tuple(causes), first)


def _charge(H: Array, g: Vector, sigma: Array, s: Suspicion, here: float) -> Charge:
    freed = sigma + spread(s)
    error, covariance = posterior(H, g, freed)
    moved = np.flatnonzero(np.any(s.directions != 0.0, axis=1))
    most = moved[int(np.argmax(np.abs(error[moved])))]
    size = float(np.hypot(*error[moved])) if s.directions.shape[1] == 2 else float(error[most])
    std = math.sqrt(max(0.0, float(covariance[most, most])))
    return Charge((s.who, s.what), size, std, evidence(H, g, freed) - here)
