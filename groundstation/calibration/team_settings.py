"""Errors of figures as settings of the field: each present and new value, and the whole field with the new ones."""

import math
from collections.abc import Mapping
from typing import Any

import msgspec
import numpy as np

from groundstation.arrays import Vector
from groundstation.calibration.team_figures import Figures, Key
from groundstation.field.resolved import ResolvedField, field_from_values
from groundstation.geometry.rotations import euler_from_rotation, rotation_from_euler

Path = tuple[str, ...]
_DEGREES = frozenset({"pan", "tilt", "roll", "pitch", "yaw"})
_PLACED = {"x": 0, "y": 1, "z": 2, "ahead": 0, "left": 1, "up": 2}
_NAMES = {"pan": "pan_left_deg", "tilt": "tilt_down_deg", "delay": "video_delay_ms"}
_ODOMETRY = {"scale": "velocity_scale", "velocity_delay": "velocity_delay_ms", "height_delay": "height_delay_ms"}


def unit_of(part: str) -> tuple[float, str]:
    """Return the factor that turns a figure's error into its displayed unit, and that unit."""
    if part in _DEGREES:
        return math.degrees(1.0), "deg"
    if part in _PLACED:
        return 100.0, "cm"
    return (1000.0, "ms") if part.endswith("delay") else (100.0, "%")


def paths_of(field: ResolvedField, key: Key) -> tuple[Path, ...]:
    """Return the settings that contain a figure; none if stamps must be mended instead."""
    who, part = key
    if part == "print":
        owner: Path = (
            ("drones", who) if who in field.drones else ("targets", who) if field.target is None else ("target",)
        )
        marker = field.drones[who].marker if who in field.drones else field.tracked[who].marker
        return ((*owner, "marker", "square_mm" if marker.size_mm is None else "size_mm"),)
    camera: Path = ("cameras", who) if who in field.cameras else ("drones", who, "camera")
    if part == "focal":
        return ((*camera, "calibration", "fx_px"), (*camera, "calibration", "fy_px"))
    if part == "own_delay":
        return ()
    if part in _ODOMETRY:
        return (("drones", who, "odometry", _ODOMETRY[part]),)
    if part in ("roll", "pitch", "yaw"):
        return ((*camera, "rotation_deg"),)
    return ((*camera, "position_m"),) if part in _PLACED else ((*camera, _NAMES[part]),)


def changes(figures: Figures, theta: Vector, moved: Vector) -> dict[Path, Any]:
    """Return new values of the settings of moved figures, rounded to what can be set."""
    field, found = figures.field, dict[Path, Any]()
    values = msgspec.to_builtins(field)
    for index in np.flatnonzero(moved):
        key = figures.keys[index]
        for path in paths_of(field, key):
            before = found.get(path, entry_at(values, path))
            found[path] = _changed(figures, theta, key, before)
    return found


def _changed(figures: Figures, theta: Vector, key: Key, now: Any) -> Any:
    who, part = key
    error = float(theta[figures.place[key]])
    if part in _PLACED:
        place = list(now)
        place[_PLACED[part]] = round(place[_PLACED[part]] + error, 4)
        return place
    if part in ("roll", "pitch", "yaw"):
        turned = rotation_from_euler(*(float(theta[figures.place[who, one]]) for one in ("roll", "pitch", "yaw")))
        known = rotation_from_euler(*np.radians(figures.field.cameras[who].rotation_deg).tolist())
        return np.round(np.degrees(euler_from_rotation(turned @ known)), 3).tolist()
    if part in _NAMES or part.endswith("delay"):
        return _settable(part, round(now + error * unit_of(part)[0], 2))
    return round(now * (1.0 + error), 4)


def _settable(part: str, value: float) -> float:
    """Return the nearest value that the setting of a figure may have [deg or ms]."""
    if part.endswith("delay"):
        return max(0.0, value)
    return round(math.remainder(value, 360.0), 2) if part == "pan" else max(-90.0, min(90.0, value))


def with_changes(field: ResolvedField, new: Mapping[Path, Any]) -> ResolvedField:
    """Return the field with settings changed."""
    values = msgspec.to_builtins(field)
    for path, value in new.items():
        entry_at(values, path[:-1])[path[-1]] = value
    return field_from_values(values)


def value_at(field: ResolvedField, path: Path) -> Any:
    """Return a setting of a field."""
    return entry_at(msgspec.to_builtins(field), path)


def entry_at(values: Any, path: Path) -> Any:
    """Return the entry at a path of nested mappings."""
    for name in path:
        values = values[name]
    return values
