"""A suspected figure in words: its error, size, deviation, and the remedy. Pure."""

from collections.abc import Sequence

from groundstation.calibration.team_settings import paths_of, unit_of
from groundstation.diagnosis.suspects import Charge
from groundstation.field.resolved import ResolvedField
from groundstation.preflight.figure_words import calibrated_lens, fixed_camera, hangs, lens_is, marker_is, measured_by

_MOST_TOLD = 3
_UNITS = {"tilted": "roll", "aside": "x"}
# For the mounting of a drone's camera: words for more, and for less.
_MOUNTED = {
    "pan": ("looks {size} farther to the left", "looks {size} farther to the right"),
    "tilt": ("looks {size} lower", "looks {size} higher"),
    "ahead": ("sits {size} farther ahead", "sits {size} farther behind"),
    "left": ("sits {size} farther to the left", "sits {size} farther to the right"),
    "up": ("sits {size} higher", "sits {size} lower"),
}
_REPORTED = {"velocity_delay": "velocities", "height_delay": "heights"}
_STAMPS = "check the clock of {who} and the link to it: all that it tells of itself is stamped wrong"
_SURVEY = "fix the camera {who} where the field has it, or survey it anew (groundstation calibrate extrinsics)"


def sentence(charges: Sequence[Charge], field: ResolvedField) -> str:
    """Return the suspects in a few words."""
    return " or ".join(_what(one, field) for one in charges[:_MOST_TOLD])


def remedies(charges: Sequence[Charge], field: ResolvedField) -> str:
    """Return the remedy for each suspect."""
    return "; or ".join(dict.fromkeys(_remedy(one, field) for one in charges[:_MOST_TOLD]))


def _what(charge: Charge, field: ResolvedField) -> str:
    (who, what), more, size = charge.suspect, charge.size > 0.0, _size(charge)
    camera = _camera(who, field)
    if what in _MOUNTED:
        return f"{camera} {_MOUNTED[what][not more].format(size=size)} than the field says"
    if what == "print":
        return marker_is(who, charge.size, charge.std)
    if what == "focal":
        return lens_is(camera, charge.size, charge.std)
    if who in field.cameras and not what.endswith("delay"):
        return hangs(who, what, more, size)
    if what == "scale":
        return f"{who}'s true velocities are {size} {'larger' if more else 'smaller'} than the field says"
    age = f"{size} {'older' if more else 'newer'}"
    if what == "own_delay":
        return f"{who}'s telemetry is {age} than its stamps say"
    if what in _REPORTED:
        return f"{who}'s {_REPORTED[what]} are {age} than configured"
    pictures = f"{who}'s pictures" if who in field.cameras else f"the pictures of {camera}"
    return f"{pictures} are {age} than configured"


def _size(charge: Charge) -> str:
    """Return the error's size and deviation in the unit of the field file."""
    _, what = charge.suspect
    factor, unit = unit_of(_UNITS.get(what, what))
    digits = 1 if unit in ("deg", "%") else 0
    return f"{abs(factor * charge.size):.{digits}f} +- {factor * charge.std:.{digits}f} {unit}"


def _camera(who: str, field: ResolvedField) -> str:
    """Return words for the camera of a suspect; "" are all drones."""
    if not who:
        return "every drone's camera"
    return fixed_camera(who) if who in field.cameras else f"{who}'s camera"


def _remedy(charge: Charge, field: ResolvedField) -> str:
    who, what = charge.suspect
    if what == "print":
        return measured_by()
    if what == "focal":
        return calibrated_lens(who or "each drone")
    if what == "own_delay":
        return _STAMPS.format(who=who)
    if what.endswith("delay"):
        return "groundstation calibrate delay"
    if who in field.cameras:
        return _SURVEY.format(who=who)
    if what == "scale":
        return "groundstation calibrate team"
    names = (who,) if who else tuple(field.drones)
    return f"fix the mounting, or set {', '.join(_setting(name, what, charge.size, field) for name in names)}"


def _setting(name: str, part: str, error: float, field: ResolvedField) -> str:
    """Return the setting that matches a camera's actual mounting."""
    path = ".".join(paths_of(field, (name, part))[0])
    camera, factor = field.drones[name].camera, unit_of(part)[0]
    now = {"pan": camera.pan_left_deg, "tilt": camera.tilt_down_deg}.get(part)
    if now is not None:
        return f"{path}: {now + factor * error:.1f}"
    place = list(camera.position_m)
    axis = ("ahead", "left", "up").index(part)
    place[axis] = round(place[axis] + error, 3)
    return f"{path}: {place}"
