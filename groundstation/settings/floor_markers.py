"""Markers laid out at known places to measure cameras with: a small YAML file, or options of a command."""

import json
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field, TypeAdapter, ValidationError
from pydantic_core import PydanticCustomError

from groundstation.errors import SettingsError
from groundstation.settings.document import read
from groundstation.settings.room import LONGEST_M, Angle
from groundstation.settings.values import MarkerCode, SettingsSection, SquareSize, Vector3
from groundstation.settings.wording import ordered, problem_of_error, text_of_error

_FARTHEST_M = LONGEST_M / 2


def _in_a_room(place: tuple[float, float, float]) -> tuple[float, float, float]:
    if max(map(abs, place)) > _FARTHEST_M:
        text = "must lie within {farthest} m of the origin: places are in metres"
        raise PydanticCustomError("in_a_room", text, {"farthest": f"{_FARTHEST_M:g}"})
    return place


class FloorMarker(SettingsSection):
    """One marker of a layout."""

    code: MarkerCode
    """Number of the marker."""
    position_m: Annotated[Vector3, AfterValidator(_in_a_room)]
    """Centre of the marker [m; world]."""
    yaw_deg: Angle | None = None
    """Direction of its bar [deg; world], counter-clockwise; none: unknown."""


class FloorMarkers(SettingsSection):
    """Markers at measured places, of one size."""

    square_mm: SquareSize = 44.0
    """Side of one square [mm]."""
    position_std_m: Annotated[float, Field(gt=0, le=0.2)] = 0.005
    """Standard deviation of the measured positions [m]."""
    markers: tuple[FloorMarker, ...]
    """The markers."""


def load_floor_markers(path: Path) -> FloorMarkers:
    """Return a layout; raises SettingsError with all problems, each with its line."""
    tree = read(path)
    try:
        return TypeAdapter(FloorMarkers).validate_json(json.dumps(tree.plain()))
    except ValidationError as error:
        found = error.errors(include_url=False)
        raise SettingsError(ordered([problem_of_error(one, tree, FloorMarkers) for one in found])) from None


def floor_marker_of(text: str) -> FloorMarker:
    """Return the marker of `3=0.5,1.0`, `3=0.5,1.0,0` or `3=0.5,1.0,0,90` (code = x, y, z [m], heading [deg]).

    Raises SettingsError with the fault.
    """
    code, equals, place = text.partition("=")
    try:
        numbers = [float(part) for part in place.split(",")]
        if not equals or not 2 <= len(numbers) <= 4:
            raise ValueError
        position = (numbers[0], numbers[1], numbers[2] if len(numbers) > 2 else 0.0)
        return FloorMarker(code=int(code), position_m=position, yaw_deg=numbers[3] if len(numbers) > 3 else None)
    except ValidationError as error:
        found = error.errors(include_url=False)
        faults = "; ".join(f"{fault['loc'][0]}: {text_of_error(fault)}" for fault in found)
        raise SettingsError([f"--marker {text}: {faults}"]) from None
    except ValueError:
        raise SettingsError([f"--marker {text}: must look like 3=0.5,1.0 or 3=0.5,1.0,0,90"]) from None
