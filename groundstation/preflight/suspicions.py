"""Finds the one wrong figure that would explain fixed cameras' sightings of standing drones. Pure."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from groundstation.preflight.pad_fit import TEAM_PRINT, Fit, Key, PadFit
from groundstation.preflight.stand import PadSighting, Stand

# One sigma of a figure that was not measured, or wrongly. A camera hangs askew, or is turned the wrong way.
_MOVED_M, _TURNED_RAD, _ASKEW_RAD, _TILTED_RAD, _SHARE, _CARRIED_M = 0.5, 0.6, 0.06, 0.15, 0.08, 1.0
# A fit is good while its chi-square is below that which chance exceeds once in 100,000 (this many sigmas).
_CHANCE_SIGMAS = 4.26
# Explanations this much less likely (1 to 20) than the best one are ruled out.
_RULED_OUT = math.log(20.0)
# Where chance might explain everything, one cause must explain it this much better (1 to 30) to be reported.
_TELLING = math.log(30.0)
_REFINED = 8
_ANGLES = frozenset({"roll", "pitch", "yaw", "turned"})


@dataclass(frozen=True, slots=True)
class Suspicion:
    """One possible cause: what is wrong, whose ("": everybody's), the figures that may then err, exchanged drones.

    what: nothing, prints, aside, height, focal, turned, tilted, placed, heading, print, exchanged.
    """

    what: str
    who: str = ""
    loose: Mapping[Key, float] = field(default_factory=dict)
    exchanged: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Explanation:
    """A suspicion that explains the sightings, and the figures that it implies."""

    suspicion: Suspicion
    fit: Fit

    def figure(self, part: str) -> tuple[float, float]:
        """Return value and standard deviation of one figure of the suspect."""
        key = (self.suspicion.who, part)
        return self.fit.value[key], self.fit.std[key]

    def size(self, *parts: str) -> tuple[float, float]:
        """Return the length of a vector of figures and its standard deviation."""
        values, stds = zip(*(self.figure(part) for part in parts), strict=True)
        length = math.hypot(*values)
        return length, math.hypot(*(s * v / length for v, s in zip(values, stds, strict=True))) if length else stds[0]


@dataclass(frozen=True, slots=True)
class Opinion:
    """The conclusion from the sightings.

    all_well: the field explains the sightings; explanations: possible causes, likeliest first; empty: no single cause
    explains them.
    """

    all_well: bool
    explanations: tuple[Explanation, ...]
    nothing_wrong: Fit


def opinion(stand: Stand, sightings: Sequence[PadSighting]) -> Opinion:
    """Return the conclusion from the sightings of standing drones, at least one."""
    plain = PadFit(stand, sightings)
    nothing = plain.explain({})
    if _good(nothing, 0):
        promised = max(plain.promise(s.loose) for s in _suspicions(plain))
        if promised - plain.promise({}) < _TELLING:
            return Opinion(True, (), nothing)
    ranked = sorted(_suspicions(plain), key=lambda s: -_promise(plain, s))[:_REFINED]
    tried = [Explanation(s, _explained(plain, s)) for s in ranked]
    good = [v for v in tried if _good(v.fit, len(v.suspicion.loose))]
    best = max((v.fit.evidence for v in good), default=-math.inf)
    left: dict[tuple[str, ...], Explanation] = {}
    for one in sorted((v for v in good if v.fit.evidence > best - _RULED_OUT), key=lambda v: -v.fit.evidence):
        left.setdefault((one.suspicion.what, one.suspicion.who, *one.suspicion.exchanged.values()), one)
    return Opinion(False, tuple(left.values()), nothing)


def _suspicions(plain: PadFit) -> Iterator[Suspicion]:
    cameras = dict.fromkeys(s.camera for s in plain.sightings)
    drones = tuple(dict.fromkeys(s.drone for s in plain.sightings))
    yield Suspicion("prints", "", {TEAM_PRINT: _SHARE})
    for name in cameras:
        yield Suspicion("aside", name, {(name, "x"): _MOVED_M, (name, "y"): _MOVED_M})
        yield Suspicion("height", name, {(name, "z"): _MOVED_M})
        yield Suspicion("focal", name, {(name, "focal"): _SHARE})
        for turn in (_ASKEW_RAD, _TURNED_RAD):
            yield Suspicion("turned", name, {(name, "yaw"): turn})
        yield Suspicion("tilted", name, {(name, "roll"): _TILTED_RAD, (name, "pitch"): _TILTED_RAD})
    for name in drones:
        place: dict[Key, float] = {(name, "aside_x"): _CARRIED_M, (name, "aside_y"): _CARRIED_M}
        yield Suspicion("placed", name, {**place, (name, "turned"): _TURNED_RAD})
        yield Suspicion("heading", name, {(name, "turned"): _TURNED_RAD})
        yield Suspicion("print", name, {(name, "print"): _SHARE})
    for one, other in combinations(drones, 2):
        yield Suspicion("exchanged", one, {}, {one: other, other: one})
    for name in drones:
        for free in plain.stand.pads.keys() - set(drones):
            yield Suspicion("exchanged", name, {}, {name: free})


def _promise(plain: PadFit, suspicion: Suspicion) -> float:
    """Return the approximate evidence of a suspicion; derivatives at zero say nothing about those with large angles."""
    if suspicion.exchanged:
        return _exchanged(plain, suspicion).promise({})
    if any(part in _ANGLES and std >= _TURNED_RAD for (_, part), std in suspicion.loose.items()):
        return _explained(plain, suspicion).evidence
    return plain.promise(suspicion.loose)


def _explained(plain: PadFit, suspicion: Suspicion) -> Fit:
    if suspicion.exchanged:
        return _exchanged(plain, suspicion).explain({})
    return plain.explain(suspicion.loose, _start(plain, suspicion))


def _exchanged(plain: PadFit, suspicion: Suspicion) -> PadFit:
    return PadFit(plain.stand.exchanged(suspicion.exchanged), plain.sightings)


def _start(plain: PadFit, suspicion: Suspicion) -> dict[Key, float]:
    """Return the start of the fit: a turn is found from headings, beyond the reach of derivatives."""
    turns = [key for key in suspicion.loose if key[1] in ("yaw", "turned")]
    if not turns:
        return {}
    who, part = turns[0]
    seen = [s for s in plain.sightings if who in (s.camera, s.drone) and math.isfinite(s.yaw_rad)]
    off = [s.yaw_rad - plain.stand.pads[s.drone].yaw_rad for s in seen]
    mean = math.atan2(float(np.sum(np.sin(off))), float(np.sum(np.cos(off)))) if off else 0.0
    return {(who, part): mean if part == "turned" else -mean}


def _good(fit: Fit, freedoms: int) -> bool:
    """Return whether chance explains the misfit (Wilson and Hilferty's approximation of chi-square)."""
    rows = max(1, fit.rows - freedoms)
    limit = rows * (1.0 - 2.0 / (9.0 * rows) + _CHANCE_SIGMAS * math.sqrt(2.0 / (9.0 * rows))) ** 3
    return fit.misfit <= limit
