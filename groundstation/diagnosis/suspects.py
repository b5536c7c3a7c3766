"""Finds the figures of the field that a stretch of flight proves wrong. Pure.

All figures and paths are fitted at once, as `calibrate team` does; causes need less evidence, because the operator
reads them as suspicions and a flight is short.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice

import numpy as np

from groundstation.arrays import Array, Vector
from groundstation.calibration.flown import Flown
from groundstation.calibration.team_batch import TeamBatch
from groundstation.calibration.team_causes import RULED_OUT, Explain, posterior, rounds, spread, sure_of, tried
from groundstation.calibration.team_figures import Suspicion
from groundstation.calibration.team_record import team_record
from groundstation.errors import OperatorMistake
from groundstation.field.resolved import ResolvedField

Suspect = tuple[str, str]
"""One thing that may be wrong: its owner ("": all) and which figure."""

# Smaller errors do no harm, and are not reported: [m], [rad], [s], shares.
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
    "own_delay": 0.03,
}
_WORTH_TELLING_M = 0.06
# Mean squared deviation of a healthy simulated flight, whose sightings err independently; a larger one means that they
# share a disturbance.
_USUAL_MISFIT = 0.25
# With all figures in doubt, no error of theirs leaves as much; noise of three times the stated size leaves 3.5.
_UNEXPLAINED_MISFIT = 4.5
_MOST = 3
# Suspects with a smaller lead in the linear model are not tried by fits; of the others, this many for each cause.
# Linearised with all figures in doubt, it preferred early pictures of all drones to late ones of the ceiling camera by
# e^12, and to a drone's late telemetry by e^0.5; fits preferred the true causes.
_WORTH_A_TRIAL, _AT_ONCE = math.log(10.0), 4
# A charge is tried again with knots that lie in the middle between those of the first fit.
_BETWEEN = 0.5


@dataclass(frozen=True, slots=True)
class Charge:
    """A suspect: its error, one sigma, and its lead: the gain (log) in evidence over no error."""

    suspect: Suspect
    size: float
    std: float
    lead: float


@dataclass(frozen=True, slots=True)
class Verdict:
    """A verdict on a stretch of flight.

    causes: for each thing that is wrong the charges that cannot be told apart, likeliest first; leads: of all suspects;
    is_unexplained: the sightings disagree by more than wrong figures can explain, so that none is accused.
    """

    causes: tuple[tuple[Charge, ...], ...]
    leads: Mapping[Suspect, float]
    is_unexplained: bool = False


def verdict_on(flown: Flown, field: ResolvedField) -> Verdict | None:
    """Return the verdict on a stretch of flight; None if it has too little, or no fit was found."""
    try:
        record = team_record(flown, field)
        batch = TeamBatch(record, field)
        wide = np.diag(batch.figures.wide**2)
        fit = batch.fit(wide)
        if fit.misfit > _UNEXPLAINED_MISFIT:
            return Verdict((), {}, is_unexplained=True)
        alike = max(1.0, fit.misfit / _USUAL_MISFIT)
        if alike > 1.0:
            fit = batch.fit(wide, alike)
        verdict = weighed(fit.information, fit.pull, batch.figures.surveyed, tuple(batch.figures.suspicions()))
        return _tried(verdict, batch, TeamBatch(record, field, _BETWEEN), alike) if verdict.causes else verdict
    except (OperatorMistake, np.linalg.LinAlgError):
        return None


def _tried(verdict: Verdict, batch: TeamBatch, between: TeamBatch, alike: float) -> Verdict:
    """Return the verdict after the flight was fitted with each of its charges, and without any.

    Leads of tried charges come from the fits: a charge that explains nothing is refuted, however large its lead in the
    linear model. Those of a cause must also lead with the knots of another batch, `between`.
    """
    known = {(s.who, s.what): s for s in batch.figures.suspicions()}
    sigma, causes, leads = np.diag(batch.figures.surveyed**2), list[tuple[Charge, ...]](), dict(verdict.leads)
    explain, again = partial(batch.fit, alike=alike), partial(between.fit, alike=alike)
    without = explain(sigma).log_evidence(sigma)
    for accused in verdict.causes:
        found = {cause[0].suspect for cause in causes}
        trials = tried(explain, sigma, [known[one.suspect] for one in accused if one.suspect not in found], without)
        charges = [
            _charge(one.explained.information, one.explained.pull, sigma, one.suspicion, one.lead) for one in trials
        ]
        if charges and is_told(charges[0]):
            near = _as_likely(charges)
            charges = _confirmed(near, [known[one.suspect] for one in near], again, sigma) + charges[len(near) :]
        if not causes:  # later leads come on top of causes that were found
            leads |= {charge.suspect: charge.lead for charge in charges}
        if not charges or not is_told(charges[0]):
            break
        best = charges[0]
        causes.append(_as_likely(charges))
        sigma, without = sigma + spread(known[best.suspect]), without + best.lead
    return Verdict(tuple(causes), leads)


def _as_likely(charges: Sequence[Charge]) -> tuple[Charge, ...]:
    """Return the charges, likeliest first, that the likeliest does not rule out."""
    return tuple(charge for charge in charges if charge.lead > charges[0].lead - RULED_OUT)


def _confirmed(
    charges: Sequence[Charge], suspicions: Sequence[Suspicion], explain: Explain, sigma: Array
) -> list[Charge]:
    """Return charges, likeliest first, with the lesser of their leads and those by another batch's fits.

    sigma (n, n): the prior without any of them.
    """
    without = explain(sigma).log_evidence(sigma)
    leads = {(one.suspicion.who, one.suspicion.what): one.lead for one in tried(explain, sigma, suspicions, without)}
    lesser = [replace(one, lead=min(one.lead, leads[one.suspect])) for one in charges]
    return sorted(lesser, key=lambda one: -one.lead)


def weighed(H: Array, g: Vector, surveyed: Vector, suspicions: Sequence[Suspicion]) -> Verdict:
    """Return the linear model's verdict from information (n, n) and pull (n) on figures surveyed to one sigma (n).

    Its charges are those worth a trial.
    """
    leads: dict[Suspect, float] = {}
    causes: list[tuple[Charge, ...]] = []
    for one in islice(rounds(H, g, surveyed, suspicions), _MOST):
        leads = leads or {(s.who, s.what): lead for s, lead in one.gains}
        likely = sorted((pair for pair in one.gains if pair[1] > _WORTH_A_TRIAL), key=lambda pair: -pair[1])
        if not likely:
            break
        charges = tuple(_charge(H, g, one.sigma, s, lead) for s, lead in likely[:_AT_ONCE])
        causes.append(charges)
    return Verdict(tuple(causes), leads)


def is_told(charge: Charge) -> bool:
    """Return whether a charge has enough evidence, and a harmful size."""
    what = charge.suspect[1]
    return charge.lead >= sure_of(what) and abs(charge.size) >= _WORTH_TELLING.get(what, _WORTH_TELLING_M)


def _charge(H: Array, g: Vector, sigma: Array, s: Suspicion, lead: float) -> Charge:
    error, covariance = posterior(H, g, sigma + spread(s))
    moved = np.flatnonzero(np.any(s.directions != 0.0, axis=1))
    most = moved[int(np.argmax(np.abs(error[moved])))]
    size = float(np.hypot(*error[moved])) if s.directions.shape[1] == 2 else float(error[most])
    return Charge((s.who, s.what), size, math.sqrt(max(0.0, float(covariance[most, most]))), lead)
