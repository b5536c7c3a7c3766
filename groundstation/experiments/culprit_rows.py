"""Labs with one fault each, and the accusation that the operator must read."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

STAND_S = 4.0
"""How long the team stands on its pads before it is judged and commanded to take off."""

WrongFigure = tuple[str, str, float]
"""Entity, part, true minus configured value: m, deg, ms, shares."""


@dataclass(frozen=True, slots=True)
class WrongLab:
    """A lab with one fault.

    errors, exchanged, faults: the fault; cameras: quality of their pictures besides. says: the first accusation,
    as a regular expression of `SUBJECT: TEXT` whose group is the size; none: no figure is wrong, none may be accused.
    size: in the unit of that text; None: it has none. on_pads: it must be found before take-off.
    diagnosed_from_s: start of the diagnosis, in seconds after the start; the order to take off comes at STAND_S.
    """

    name: str
    errors: tuple[WrongFigure, ...] = ()
    exchanged: tuple[tuple[str, str], ...] = ()
    faults: tuple[Mapping[str, Any], ...] = ()
    cameras: Mapping[str, Any] | None = None
    says: str = ""
    size: float | None = None
    on_pads: bool = False
    diagnosed_from_s: float = 0.0

    @property
    def since_s(self) -> float:
        """Begin of the fault, in seconds after the order to take off; 0: from the start."""
        starts = [float(fault["start_s"]) for fault in self.faults]
        return max([STAND_S, *starts]) - STAND_S


_FIGURE = r"(-?[\d.]+) \+- [\d.]+"
_LATE_MS, _TURN_DEG, _ASIDE_M, _PRINT, _FOCAL = 50.0, 3.0, 0.2, 0.05, 0.03
_BUMP_DEG, _BUMPED_AT_S = 5.0, 22.0
_FAILS_AT_S = 22.0
_ALL_FLY_S = 18.0


def labs_of(field: Mapping[str, Any]) -> tuple[WrongLab, ...]:
    """Return all rows for a resolved field, with its first fixed camera, two drones and target."""
    ceiling, target = next(iter(field["cameras"])), (field["target"] or {}).get("name") or next(iter(field["targets"]))
    one, other = list(field["drones"])[:2]
    return (
        *_healthy(),
        *_delays(ceiling, one),
        *_mountings(one, other),
        *_sizes(target, one, field["drones"]),
        *_roots(ceiling),
        *_places(one, other),
        *_failures(ceiling, one),
    )


def _healthy() -> Iterable[WrongLab]:
    yield WrongLab("nothing")
    yield WrongLab("30 % of frames lost", cameras={"frame_loss": 0.3})
    yield WrongLab("corner noise x 3", cameras={"corner_noise_px": 0.6})
    yield WrongLab("diagnosis begun in the air", diagnosed_from_s=_ALL_FLY_S)


def _delays(ceiling: str, one: str) -> Iterable[WrongLab]:
    def late(subject: str) -> str:
        return rf"{subject}: (?:\S+'s pictures are|the pictures of \S+ camera are|its pictures seem) {_FIGURE} ms older"

    yield WrongLab("ceiling's pictures", ((ceiling, "delay", _LATE_MS),), says=late(ceiling), size=_LATE_MS)
    yield WrongLab("a drone's pictures", ((one, "delay", _LATE_MS),), says=late(one), size=_LATE_MS)
    stamped = {"kind": "telemetry_delayed", "entity": one, "start_s": 0.0, "value": _LATE_MS / 1e3}
    told = rf"{one}: {one}'s telemetry is {_FIGURE} ms older"
    yield WrongLab("a drone's telemetry", faults=(stamped,), says=told, size=_LATE_MS)


def _mountings(one: str, other: str) -> Iterable[WrongLab]:
    for part, direction in (("pan", "farther to the left"), ("tilt", "lower")):
        looks = rf"looks {_FIGURE} deg {direction}"
        own = rf"{one}: {one}'s camera {looks}"
        yield WrongLab(f"{part} of one", ((one, part, _TURN_DEG),), says=own, size=_TURN_DEG)
        both = tuple((name, part, _TURN_DEG) for name in (one, other))
        yield WrongLab(f"{part} of both", both, says=rf": every drone's camera {looks}", size=_TURN_DEG)


def _sizes(target: str, one: str, drones: Iterable[str]) -> Iterable[WrongLab]:
    larger, percent = rf"{_FIGURE} % larger", 100.0 * _PRINT
    yield WrongLab(
        "target's marker", ((target, "print", _PRINT),), says=rf".*: {target}'s marker is {larger}", size=percent
    )
    own = rf".*: {one}'s marker is {larger}"
    yield WrongLab("a drone's marker", ((one, "print", _PRINT),), says=own, size=percent, on_pads=True)
    prints = tuple((name, "print", _PRINT) for name in (*drones, target))
    yield WrongLab("all markers", prints, says=rf".*: all markers are {larger}", size=percent, on_pads=True)
    longer = rf"{one}: {one}'s camera has a focal length {_FIGURE} % longer"
    yield WrongLab("a drone's lens", ((one, "focal", _FOCAL),), says=longer, size=100.0 * _FOCAL)


def _roots(ceiling: str) -> Iterable[WrongLab]:
    aside = rf".*: the camera {ceiling} hangs {_FIGURE} m to the side"
    yield WrongLab("ceiling aside", ((ceiling, "x", _ASIDE_M),), says=aside, size=_ASIDE_M, on_pads=True)
    for part, word in (("yaw", "turned"), ("roll", "tilted")):
        said = rf".*: the camera {ceiling} is {word} by {_FIGURE} deg"
        yield WrongLab(f"ceiling {word}", ((ceiling, part, _TURN_DEG),), says=said, size=_TURN_DEG, on_pads=True)
    bump = {"kind": "camera_bumped", "entity": ceiling, "start_s": _BUMPED_AT_S, "value": _BUMP_DEG}
    said = rf"{ceiling}: was bumped: .* turned by {_FIGURE} deg"
    yield WrongLab("ceiling bumped", faults=(bump,), says=said, size=_BUMP_DEG)


def _places(one: str, other: str) -> Iterable[WrongLab]:
    said = rf".*: {one} stands on the pad of {other}|.*: {other} stands on the pad of {one}"
    yield WrongLab("markers exchanged", exchanged=((one, other), (other, one)), says=said, on_pads=True)
    carried = ((one, "pad_x", 0.4), (one, "pad_y", -0.3))
    yield WrongLab("a wrong pad", carried, says=rf".*: {one} stands {_FIGURE} m from its pad", size=0.5, on_pads=True)
    turned = ((one, "pad_yaw", 20.0),)
    said = rf".*: {one}'s marker is turned by {_FIGURE} deg"
    yield WrongLab("turned on its pad", turned, says=said, size=20.0, on_pads=True)


def _failures(ceiling: str, one: str) -> Iterable[WrongLab]:
    """Yield labs with correct figures in which a device fails."""

    def fails(name: str, kind: str, entity: str, value: float | None = None) -> WrongLab:
        fault = {"kind": kind, "entity": entity, "start_s": _FAILS_AT_S} | ({} if value is None else {"value": value})
        return WrongLab(name, faults=(fault,))

    yield fails("ceiling's picture hangs", "picture_frozen", ceiling)
    yield fails("a drone's picture hangs", "picture_frozen", one)
    yield fails("a drone's telemetry hangs", "telemetry_frozen", one)
    yield fails("a drone's velocity is stuck", "velocity_stuck", one, 0.0)


def size_told(lab: WrongLab, line: str) -> float | None:
    """Return the size in a line that accuses the right culprit, NaN without a size; None for another culprit."""
    found = re.match(lab.says, line) if lab.says else None
    if found is None:
        return None
    return float(found[1]) if found.lastindex else float("nan")
