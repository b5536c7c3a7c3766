"""Heights of searches, from which turning robots see most of the floor, and of ways back into a fixed view."""

from collections.abc import Sequence

import numpy as np

from groundstation.arrays import Array
from groundstation.control.search_ranges import search_ranges_m, searching_cameras
from groundstation.field.resolved import ResolvedField
from groundstation.sensing.footprint import footprint_of, turn_view
from groundstation.sensing.from_field import sensors_from_field
from groundstation.sensing.models import Rectangle

_STEP_M, _CELL_M = 0.05, 0.2
_AMPLE_M = 1.0  # short side of a view that a returning robot does not miss: it is less well known than 0.5 m


def search_height_m(field: ResolvedField) -> float:
    """Return the height [m], of the planned ones, from which the team's cameras show most of the floor in a turn.

    From too low, far markers are seen too obliquely; from too high, all are far, and the blind spot beneath is wider.
    """
    sensors = sensors_from_field(field)
    marker_m = max((sensors.marker_height_m[name] for name in field.tracked), default=0.0)
    heights = _planned_heights(field)
    cameras = list(searching_cameras(sensors.onboard, search_ranges_m(field)).values())
    seen = [
        sum(turn_view(footprint_of(camera, _CELL_M, height, marker_m, sensors.softness)) for camera in cameras)
        for height in heights.tolist()
    ]
    return round(float(heights[int(np.argmax(seen))]), 2)


def return_height_m(field: ResolvedField, highest_m: float) -> float:
    """Return the height [m] of ways back: the highest planned one with an ample fixed view, at most a search's.

    Views are narrower higher up, under a low ceiling hardly wider than a robot. Without an ample one it is the height
    of the widest view, without any view that of a search. highest_m: the height of a search.
    """
    sensors = sensors_from_field(field)
    marker_m = max((sensors.marker_height_m[name] for name in field.drones), default=0.0)
    heights: list[float] = [height for height in _planned_heights(field).tolist() if height < highest_m]
    sides = {height: _short_side_m(sensors.root_views(height + marker_m)) for height in (highest_m, *reversed(heights))}
    widest_m = max(sides, key=lambda height: sides[height])
    return round(next((height for height, side in sides.items() if side >= _AMPLE_M), widest_m), 2)


def _short_side_m(views: Sequence[Rectangle]) -> float:
    """Return the short side of the view where that is longest, 0 without one."""
    return max((min(view.x_m[1] - view.x_m[0], view.y_m[1] - view.y_m[0]) for view in views), default=0.0)


def _planned_heights(field: ResolvedField) -> Array:
    planned = [height for row in field.planner.level_heights_m for height in row]
    return np.arange(min(planned), max(planned) + 0.5 * _STEP_M, _STEP_M)
