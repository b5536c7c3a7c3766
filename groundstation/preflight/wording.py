"""An explanation in words: the error, its size and deviation, and the remedy. Pure."""

import math
from collections.abc import Callable, Iterable, Mapping

import numpy as np

from groundstation.doctor.finding import Finding, Level
from groundstation.field.resolved import ResolvedField
from groundstation.field.targets import Marker
from groundstation.geometry.rotations import euler_from_rotation, rotation_from_euler
from groundstation.preflight.figure_words import calibrated_lens, fixed_camera, hangs, lens_is, marker_is, measured_by
from groundstation.preflight.suspicions import Explanation, Opinion

SUBJECT = "pads"
# From this size on a flight is not worth its risk (docs/explanation/preflight.md#checks-of-standing-drones).
_MUST_SHARE, _MUST_M, _MUST_TURN, _MUST_TILT = 0.02, 0.08, math.radians(1.5), math.radians(1.2)
_MUST_PLACED_M, _MUST_HEADING = 0.25, math.radians(10.0)
# As near as this to 180 degrees a heading is that of a tag printed from AprilTag's images.
_HALF_TURN = math.radians(20.0)
_MOST_TOLD = 3
_SURVEY = ", or survey it: groundstation calibrate extrinsics"
_Told = tuple[bool, str, str]
"""Whether it must be mended, the fault, and the remedy."""


def finding(field: ResolvedField, opinion: Opinion) -> Finding:
    """Return the finding for an opinion."""
    if opinion.all_well:
        chance = f"chi-square {opinion.nothing_wrong.misfit:.0f} of {opinion.nothing_wrong.rows} rows"
        return Finding(Level.OK, SUBJECT, f"every drone that is seen stands where the field says ({chance})")
    if not opinion.explanations:
        return _unexplained(opinion)
    told = [_WORDS[e.suspicion.what](field, e) for e in opinion.explanations[:_MOST_TOLD]]
    level = Level.MUST if any(must for must, _, _ in told) else Level.SHOULD
    if len(told) == 1:
        return Finding(level, SUBJECT, told[0][1], told[0][2])
    either = ", or ".join(text for _, text, _ in told)
    survey = _SURVEY if any(remedy.endswith(_SURVEY) for _, _, remedy in told) else ""
    checks = "; or ".join(remedy.removesuffix(_SURVEY) for _, _, remedy in told) + survey
    return Finding(level, SUBJECT, f"{either}: these cannot be told apart here; the first is the likeliest", checks)


def shown_by(markers: Iterable[Marker]) -> str:
    """Return words for the command that shows these markers in a camera's pictures."""
    dictionaries = sorted({marker.dictionary for marker in markers if marker.dictionary is not None})
    return f"groundstation camera view{' --dictionary ' * bool(dictionaries)}{','.join(dictionaries)} shows it"


def _unexplained(opinion: Opinion) -> Finding:
    fit = opinion.nothing_wrong
    found = (
        f"no single wrong figure explains where the drones are seen (chi-square {fit.misfit:.0f} of {fit.rows} rows)"
    )
    remedy = "check pads, markers and the cameras' mountings (groundstation calibrate extrinsics)"
    return Finding(Level.MUST if fit.misfit > 10 * fit.rows else Level.SHOULD, SUBJECT, found, remedy)


def _prints(field: ResolvedField, e: Explanation) -> _Told:
    value, std = e.figure("print")
    squares = {drone.marker.square_mm for drone in field.drones.values() if drone.marker.size_mm is None}
    told = "".join(f" ({one * (1 + value):.1f} mm for {one:g})" for one in sorted(squares)[:1])
    return abs(value) >= _MUST_SHARE, marker_is("", value, std), measured_by(told=told)


def _print(field: ResolvedField, e: Explanation) -> _Told:
    (value, std), who = e.figure("print"), e.suspicion.who
    return abs(value) >= _MUST_SHARE, marker_is(who, value, std), measured_by(f"drones.{who}.marker to its size")


def _focal(field: ResolvedField, e: Explanation) -> _Told:
    (value, std), who = e.figure("focal"), e.suspicion.who
    return abs(value) >= _MUST_SHARE, lens_is(fixed_camera(who), value, std), calibrated_lens(who)


def _moved(field: ResolvedField, e: Explanation, text: str, size_m: float) -> _Told:
    who = e.suspicion.who
    place = (p + e.fit.value[who, axis] for p, axis in zip(field.cameras[who].position_m, "xyz", strict=True))
    x, y, z = place if e.suspicion.what == "aside" else (*field.cameras[who].position_m[:2], tuple(place)[2])
    remedy = f"set cameras.{who}.position_m: [{x:.2f}, {y:.2f}, {z:.2f}]{_SURVEY}"
    return abs(size_m) >= _MUST_M, text, remedy


def _aside(field: ResolvedField, e: Explanation) -> _Told:
    size, std = e.size("x", "y")
    x, y = e.figure("x")[0], e.figure("y")[0]
    text = hangs(e.suspicion.who, "aside", True, f"{size:.2f} +- {std:.2f} m")
    return _moved(field, e, f"{text} (x {x:+.2f}, y {y:+.2f})", size)


def _height(field: ResolvedField, e: Explanation) -> _Told:
    value, std = e.figure("z")
    text = hangs(e.suspicion.who, "z", value > 0.0, f"{abs(value):.2f} +- {std:.2f} m")
    return _moved(field, e, text, value)


def _rotation(field: ResolvedField, e: Explanation, text: str, must: bool) -> _Told:
    who = e.suspicion.who
    error = rotation_from_euler(*(e.fit.value[who, part] for part in ("roll", "pitch", "yaw")))
    known = rotation_from_euler(*np.radians(field.cameras[who].rotation_deg).tolist())
    roll, pitch, yaw = np.degrees(euler_from_rotation(error @ known)).tolist()
    return must, text, f"set cameras.{who}.rotation_deg: [{roll:.1f}, {pitch:.1f}, {yaw:.1f}]{_SURVEY}"


def _turned(field: ResolvedField, e: Explanation) -> _Told:
    value, std = e.figure("yaw")
    text = hangs(e.suspicion.who, "yaw", value > 0.0, _degrees(value, std))
    return _rotation(field, e, text, abs(value) >= _MUST_TURN)


def _tilted(field: ResolvedField, e: Explanation) -> _Told:
    size, std = e.size("roll", "pitch")
    text = hangs(e.suspicion.who, "tilted", True, _degrees(size, std))
    return _rotation(field, e, text, size >= _MUST_TILT)


def _degrees(value: float, std: float) -> str:
    return f"{abs(math.degrees(value)):.1f} +- {math.degrees(std):.1f} deg"


def _placed(field: ResolvedField, e: Explanation) -> _Told:
    who, (size, std), (turn, _) = e.suspicion.who, e.size("aside_x", "aside_y"), e.figure("turned")
    x, y = (p + e.figure(part)[0] for p, part in zip(field.drones[who].pad_m, ("aside_x", "aside_y"), strict=True))
    text = f"{who} stands {size:.2f} +- {std:.2f} m from its pad, turned by {math.degrees(turn):.0f} deg"
    remedy = f"put it on its pad, or set drones.{who}.pad_m: [{x:.2f}, {y:.2f}]"
    return size >= _MUST_PLACED_M or abs(turn) >= _MUST_HEADING, text, remedy


def _heading(field: ResolvedField, e: Explanation) -> _Told:
    who, (value, std) = e.suspicion.who, e.figure("turned")
    text = (
        f"{who}'s marker is turned by {math.degrees(value):.0f} +- {math.degrees(std):.0f} deg from its pad's heading"
    )
    remedy = f"turn {who} on its pad; if it stands right, its marker is turned, and it would fly the wrong way"
    april = (field.drones[who].marker.dictionary or "").startswith("DICT_APRILTAG")
    if april and math.pi - abs(value) <= _HALF_TURN:
        remedy += " (AprilTag's own images are turned by 180 deg: groundstation markers print)"
    return abs(value) >= _MUST_HEADING, text, remedy


def _exchanged(field: ResolvedField, e: Explanation) -> _Told:
    pairs = [f"{one} stands on the pad of {other}" for one, other in e.suspicion.exchanged.items()]
    names = " and ".join(dict.fromkeys((*e.suspicion.exchanged, *e.suspicion.exchanged.values())))
    remedy = (
        "read their markers, and see with `groundstation vehicle blink` which answers to which name: then exchange the "
        f"drones, or the marker codes (or pads) of {names} in the field file"
    )
    return True, ", and ".join(pairs), remedy


_WORDS: Mapping[str, Callable[[ResolvedField, Explanation], _Told]] = {
    "prints": _prints,
    "print": _print,
    "focal": _focal,
    "aside": _aside,
    "height": _height,
    "turned": _turned,
    "tilted": _tilted,
    "placed": _placed,
    "heading": _heading,
    "exchanged": _exchanged,
}
