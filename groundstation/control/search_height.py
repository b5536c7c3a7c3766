"""Search height: that from which turning robots see most of the floor."""

import numpy as np

from groundstation.control.search_ranges import search_ranges_m, searching_cameras
from groundstation.field.resolved import ResolvedField
from groundstation.sensing.footprint import footprint_of, turn_view
from groundstation.sensing.from_field import sensors_from_field

_STEP_M, _CELL_M = 0.05, 0.2


def search_height_m(field: ResolvedField) -> float:
    """Return the height [m], of the planned ones, from which the team's cameras show most of the floor in a turn.

    From too low, far markers are seen too obliquely; from too high, all are far, and the blind spot beneath is wider.
    """
    sensors = sensors_from_field(field)
    marker_m = max((sensors.marker_height_m[name] for name in field.tracked), default=0.0)
    planned = [height for row in field.planner.level_heights_m for height in row]
    heights = np.arange(min(planned), max(planned) + 0.5 * _STEP_M, _STEP_M)
    cameras = list(searching_cameras(sensors.onboard, search_ranges_m(field)).values())
    seen = [
        sum(turn_view(footprint_of(camera, _CELL_M, height, marker_m, sensors.softness)) for camera in cameras)
        for height in heights.tolist()
    ]
    return round(float(heights[int(np.argmax(seen))]), 2)
