"""Finds checkerboards too small in a picture to be read at the distances that the field plans."""

import math
from collections.abc import Iterator

import numpy as np

from groundstation.settings.drones import Drone
from groundstation.settings.in_view import STANDING_MARKER_M, in_picture
from groundstation.settings.parts import Finding
from groundstation.settings.room import CalibrationSettings
from groundstation.settings.schema import Field

# Measured (docs/reference/vision.md 8): of boards with squares of 4 px 9 in 10 are found and 5 to 7 identified;
# with 5 px nearly all. How far such a board's distance can be trusted is pad_fit.py's own figure.
_LEAST_PX = 4.0


def too_small(field: Field) -> Iterator[Finding]:
    """Yield the pads on which no fixed camera can read a drone's marker, and a planned range that no camera has."""
    for name, drone in field.drones.items():
        if drone.marker.kind == "checkerboard":
            yield from _on_its_pad(field, name, drone)
    yield from _planned_range(field)


def _on_its_pad(field: Field, name: str, drone: Drone) -> Iterator[Finding]:
    centre = np.array([*drone.pad_m, STANDING_MARKER_M])
    seen = {
        camera: _pixels(one.calibration, drone.marker.square_mm, math.dist(one.position_m, centre.tolist()))
        for camera, one in field.cameras.items()
        if in_picture(one, centre)
    }
    if seen and (most := max(seen.values())) < _LEAST_PX:
        camera = max(seen, key=lambda one: seen[one])
        text = f"on a pad they have {most:.1f} px in its picture, and are read from {_LEAST_PX:g}"
        path = ("drones", name, "marker", "square_mm")
        yield path, f"is too small for {camera} (got {drone.marker.square_mm:g}): {text}"


def _planned_range(field: Field) -> Iterator[Finding]:
    boards = [*(one.marker for one in field.drones.values()), *(one.marker for one in field.tracked.values())]
    if any(board.kind != "checkerboard" for board in boards):
        return
    most_mm, range_m = max(board.square_mm for board in boards), field.planner.planned_range_m
    found = {name: _pixels(one.camera.calibration, most_mm, range_m) for name, one in field.drones.items()}
    if short := sorted(name for name, pixels in found.items() if pixels < _LEAST_PX):
        worst = min(short, key=lambda name: found[name])
        text = f"from there squares of {most_mm:g} mm have {found[worst]:.1f} px in the picture of {worst}'s camera"
        path = ("planner", "planned_range_m")
        yield path, f"is too far (got {range_m:g}): {text}, and are read from {_LEAST_PX:g}"


def _pixels(lens: CalibrationSettings, square_mm: float, distance_m: float) -> float:
    """Return the side of a square in the middle of a picture, face on [px]."""
    return lens.fx_px * square_mm / 1000 / distance_m
