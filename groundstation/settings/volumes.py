"""Warnings about boxes in which motion capture and ranging systems see drones, and anchors in one line or plane."""

from collections.abc import Iterator

import numpy as np

from groundstation.settings.in_view import STANDING_MARKER_M
from groundstation.settings.motion_capture import VolumeSettings
from groundstation.settings.parts import Finding
from groundstation.settings.ranging_checks import untold_directions
from groundstation.settings.schema import Field
from groundstation.settings.values import Vector3

_BEYOND_ROOM_M = 1.0


def volume_cautions(field: Field) -> Iterator[Finding]:
    """Yield boxes and origins beyond the room, and boxes without the heights at which the drones stand and fly."""
    boxes = {("motion_capture", name): one for name, one in field.motion_capture.items()}
    seen = {path: one.volume_m for path, one in boxes.items() if path[1] != field.truth.get("from")}
    seen |= {("ranging", name): one.volume_m for name, one in field.ranging.items()}
    for path, box in seen.items():
        yield from (((*path, "volume_m", axis), text) for axis, text in _outside_room(field, box))
    for path, system in boxes.items():
        yield from (((*path, "position_m"), text) for text in _origin_outside(field, system.position_m))
    if seen and not field.cameras:
        yield from _blind_heights(field, seen)


def anchor_cautions(field: Field) -> Iterator[Finding]:
    """Yield systems whose anchors lie in one line or plane, or nearly so, and what their ranges do not tell."""
    for name, system in field.ranging.items():
        across = untold_directions(system)
        if len(across) > 1:
            yield ("ranging", name, "anchors"), "lie nearly in one line: ranges tell a circle around it, and no place"
        elif len(across):
            axis = "xyz"[int(np.argmax(np.abs(across[0])))]
            text = f"lie nearly in one plane: places across it (mostly along {axis}) are hardly told, or mirrored"
            yield ("ranging", name, "anchors"), text


def _outside_room(field: Field, box: VolumeSettings) -> Iterator[tuple[str, str]]:
    for axis, (low, high) in field.room.inside.items():
        least, most = getattr(box, axis)
        if least < low - _BEYOND_ROOM_M or most > high + _BEYOND_ROOM_M:
            meant = "z points up here, whatever the system's own axes do: exchange y_m and z_m"
            remedy = meant if axis == "z_m" and _lies_on_its_side(field, box) else "is this in metres?"
            yield axis, f"reaches beyond the room, {low:g} to {high:g} m (got {least:g} to {most:g}): {remedy}"


def _lies_on_its_side(field: Field, box: VolumeSettings) -> bool:
    """Return whether y and z would fit the room if they were exchanged: given along the axes of a system with y up."""
    exchanged, inside = {"y_m": box.z_m, "z_m": box.y_m}, field.room.inside
    return all(
        inside[axis][0] - _BEYOND_ROOM_M <= least and most <= inside[axis][1] + _BEYOND_ROOM_M
        for axis, (least, most) in exchanged.items()
    )


def _origin_outside(field: Field, origin_m: Vector3) -> Iterator[str]:
    size_m = max(field.room.size_m)
    if max(map(abs, origin_m)) > size_m:
        yield f"is beyond the room (got {max(origin_m, key=abs):g}): is this in metres?"


def _blind_heights(field: Field, boxes: dict[tuple[str, str], VolumeSettings]) -> Iterator[Finding]:
    """Yield a height at which no system sees the drones, where no camera does either."""
    lowest_m, highest_m = field.planner.heights_m
    path, box = next(iter(boxes.items()))
    for height_m, what in ((STANDING_MARKER_M, "stand"), (lowest_m, "fly"), (highest_m, "fly")):
        if not any(one.z_m[0] <= height_m <= one.z_m[1] for one in boxes.values()):
            low, high = box.z_m
            text = f"leaves out {height_m:g} m (got {low:g} to {high:g}), where drones {what}: nothing sees them there"
            yield (*path, "volume_m", "z_m"), text
            return
