"""Compares the places of standing drones, by motion capture and ranging systems, with their pads. Pure."""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence

from groundstation.doctor.finding import Finding, Level
from groundstation.field.drones import FieldDrone
from groundstation.field.resolved import ResolvedField
from groundstation.field.room import OFF_PAD_M
from groundstation.preflight.stand import PadSighting

_TURNED_RAD = math.radians(25.0)

_BODIES = "check that it streams rigid bodies, their names, up, position_m and yaw_deg in the field file"
_RADIOS = "check that its gateway runs, the names of transponders and anchors, and that four anchors answer"
_UNFOLLOWED = "check its body's or transponder's name in the system, and what hides it"
_ELSEWHERE = "check who has its name in the system, where it stands, and the system's axes or anchors in the field file"


def captured_pad_findings(
    field: ResolvedField,
    sightings: Sequence[PadSighting],
    flew: Collection[str] = (),
    aloft: Collection[str] = (),
) -> Iterator[Finding]:
    """Yield findings of motion capture and ranges on standing drones: not followed, elsewhere, or well.

    One that flew may stand anywhere.
    """
    remedies = dict.fromkeys(field.sensing_capture, _BODIES) | dict.fromkeys(field.ranging, _RADIOS)
    for system, remedy in remedies.items():
        known = {s.drone: s for s in sightings if s.camera == system and s.drone in field.drones}
        if not known and not aloft:
            yield Finding(Level.MUST, system, "follows none of the drones", remedy)
            continue
        for name in field.drones:
            if name in known and name in flew:
                yield Finding(Level.OK, name, f"{system} follows it")
            elif name in known:
                yield _judged(name, known[name], field.drones, _aside_limit_m(field, system))
            elif name not in aloft:
                yield Finding(Level.SHOULD, name, f"{system} does not follow it", _UNFOLLOWED)


def _aside_limit_m(field: ResolvedField, system: str) -> float:
    ranging = field.ranging.get(system)
    return OFF_PAD_M if ranging is None else ranging.pad_limit_m


def _judged(name: str, seen: PadSighting, drones: Mapping[str, FieldDrone], aside_limit_m: float) -> Finding:
    pad = drones[name]
    aside_m = _aside_m(seen, pad)
    others = [other for other, drone in drones.items() if other != name and _aside_m(seen, drone) < aside_limit_m]
    if aside_m >= aside_limit_m:
        where = f", on the pad of {others[0]}" if others else ""
        found = f"{seen.camera} has it {aside_m:.2f} m from its pad{where}"
        return Finding(Level.MUST, name, found, _ELSEWHERE)
    turned = math.remainder(seen.yaw_rad - math.radians(pad.pad_yaw_deg), math.tau)
    if abs(turned) >= _TURNED_RAD:  # ranges give no heading: it is NaN
        found = f"{seen.camera} has its heading {math.degrees(turned):.0f} deg off that of its pad"
        remedy = "turn it, or define its body anew while it looks along the system's x axis (or give bodies.yaw_deg)"
        return Finding(Level.MUST, name, found, remedy)
    return Finding(Level.OK, name, f"{seen.camera} has it {aside_m:.2f} m from its pad")


def _aside_m(seen: PadSighting, drone: FieldDrone) -> float:
    return math.dist(seen.position_m[:2], drone.pad_m)
