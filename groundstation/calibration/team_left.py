"""The errors that remain in a wrong field after some of its settings were changed. Pure."""

from collections.abc import Iterable, Sequence

from groundstation.calibration.team_figures import FIXED, ONBOARD, Key
from groundstation.calibration.team_settings import paths_of, value_at
from groundstation.field.resolved import ResolvedField

Error = tuple[str, str, float]
"""An error: owner, part, true minus set: m, deg, ms, shares."""
_AXES = ("x", "y", "z"), ("ahead", "left", "up"), ("roll", "pitch", "yaw")


def errors_left(errors: Sequence[Error], before: ResolvedField, after: ResolvedField) -> tuple[Error, ...]:
    """Return the errors (true minus set) of a changed field; errors: those before the change."""
    told = {(who, part): size for who, part, size in errors}
    left = {key: _left(key, told.get(key, 0.0), before, after) for key in _keys(before)}
    return tuple((who, part, size) for (who, part), size in left.items() if size)


def _keys(field: ResolvedField) -> Iterable[Key]:
    yield from ((name, "print") for name in (*field.drones, *field.tracked))
    yield from ((name, part) for name in field.cameras for part in FIXED)
    yield from ((name, part) for name in field.drones for part in ONBOARD)


def _left(key: Key, error: float, before: ResolvedField, after: ResolvedField) -> float:
    path, part = paths_of(before, key)[0], key[1]
    was, now = value_at(before, path), value_at(after, path)
    if part in ("print", "focal"):
        return float((1.0 + error) * was / now - 1.0) if was != now else error
    for axes in _AXES:
        if part in axes:
            was, now = was[axes.index(part)], now[axes.index(part)]
    return float(error + was - now)
