"""The part of the floor that a search can show at all: from stands that robots may fly to, and by fixed cameras."""

import math
from collections.abc import Iterable

import numpy as np

from groundstation.arrays import Array, BoolArray
from groundstation.control.excursion import time_left_s
from groundstation.control.parameters import ControlParameters
from groundstation.control.search_parameters import SearchParameters
from groundstation.control.sweeps import Lattice
from groundstation.control.view import VIEW_INSET_M, way_back_m
from groundstation.estimation.room_map import Cells, RoomGrid
from groundstation.sensing.detection import FOUND_SHARE, detection_map
from groundstation.sensing.footprint import Footprint
from groundstation.sensing.models import SensorSuite
from groundstation.sensing.visibility import CameraRow

_IN_VIEW = 0.5 * FOUND_SHARE  # at the border of a view: beyond it markers are found by luck


def permitted(
    name: str,
    places: Array,
    extra_m: Array,
    parameters: SearchParameters,
    control: ControlParameters,
    sensors: SensorSuite,
) -> BoolArray:
    """Return to which places (n, 2) a robot may ever fly in a search: clear of obstacles, and back in view in time.

    It leaves the view known as well as a camera sees it. One that flies on our estimate does not leave it at all.
    extra_m: by `extra_ways_m`.
    """
    views = sensors.root_views(control.return_height_m + sensors.marker_height_m[name])
    if not views:
        return np.isfinite(extra_m)
    way_m = np.min([way_back_m(places, view.shrunk(VIEW_INSET_M)) for view in views], axis=0) + extra_m
    if name in control.fed:
        return np.asarray(way_m <= VIEW_INSET_M)
    left_s = time_left_s(control.seen_std_m, 0.0, control) - control.return_margin_s - parameters.look_s
    needed_s = way_m / parameters.speed_m_s + way_m / control.return_speed_m_s
    return np.asarray((way_m == 0.0) | (needed_s <= left_s))


def extra_ways_m(name: str, places: Array, control: ControlParameters, sensors: SensorSuite) -> Array:
    """Return how much longer a robot's ways back from stands (n, 2) are past obstacles [m].

    Infinite for stands that are too near to an obstacle, or from which no way is known.
    """
    detours, height_m = control.detours, control.return_height_m
    extra_m = np.where(detours.clear_of(places, control.search_height_m), 0.0, np.inf)
    views = sensors.root_views(height_m + sensors.marker_height_m[name])
    for stand, (x, y) in enumerate(places.tolist() if detours.obstacles and views else ()):
        goal = min((view.nearest(x, y) for view in views), key=lambda goal: math.dist(goal, (x, y)))
        extra_m[stand] += detours.extra_m((x, y), goal, height_m)
    return extra_m


def shown_from(grid: RoomGrid, lattice: Lattice, free: BoolArray, footprint: Footprint) -> Cells:
    """Return the cells that a robot sees from any of its permitted stands, whatever its heading."""
    shown = np.zeros(grid.shape, dtype=np.bool_)
    sure = footprint.chances >= _IN_VIEW
    around = np.unique(np.array([footprint.rows[sure], footprint.columns[sure]]), axis=1)
    for stand in np.flatnonzero(free).tolist():
        rows, columns = around[0] + lattice.rows[stand], around[1] + lattice.columns[stand]
        inside = (rows >= 0) & (rows < grid.shape[0]) & (columns >= 0) & (columns < grid.shape[1])
        shown[rows[inside], columns[inside]] = True
    return shown


def shown_by_fixed(grid: RoomGrid, cameras: Iterable[CameraRow], marker_m: float) -> Cells:
    """Return the cells in which fixed cameras see a target's marker at a height [m]."""
    shown = np.zeros(grid.shape, dtype=np.bool_)
    for camera in cameras:
        shown |= detection_map(camera, np.zeros(4), 0.0, grid.xs, grid.ys, marker_m) >= _IN_VIEW
    return shown
