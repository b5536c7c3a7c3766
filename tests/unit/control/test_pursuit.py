"""A team whose target was carried off searches unexplored places, apart, and leaves time for its own return."""

import math

import numpy as np
import pytest

from groundstation.control.parameters import control_from_field
from groundstation.control.pursuit import choose_pursuit
from groundstation.control.search_parameters import search_from_field
from groundstation.control.search_ranges import searching_cameras
from groundstation.control.sweeps import Lattice, Outlook, lattice_of
from groundstation.estimation.room_map import RoomGrid
from groundstation.field.resolved import ResolvedField
from groundstation.sensing.footprint import Footprint, footprint_of
from groundstation.sensing.from_field import sensors_from_field

GRID = RoomGrid.over(8.0, 6.0)
POSES = {"drone_1": np.array([-0.5, 0.5, 1.45, 0.0]), "drone_2": np.array([-0.5, -0.5, 1.45, 0.0])}


@pytest.fixture
def lattice(lab_field: ResolvedField) -> Lattice:
    return lattice_of(GRID, search_from_field(lab_field))


def chosen(
    lab_field: ResolvedField, lattice: Lattice, chances: np.ndarray, allowed_s: dict[str, np.ndarray] | None = None
) -> Outlook:
    sensors, parameters = sensors_from_field(lab_field), search_from_field(lab_field)
    cameras = searching_cameras(sensors.onboard, parameters.ranges_m)
    height_m = control_from_field(lab_field).search_height_m
    views: dict[str, Footprint] = {
        name: footprint_of(cameras[name], GRID.cell_m, height_m, 0.4, sensors.softness) for name in POSES
    }
    anywhen = {name: np.full(len(lattice.places), math.inf) for name in POSES}
    return choose_pursuit(chances, lattice, views, POSES, allowed_s or anywhen, {}, parameters)


def even() -> np.ndarray:
    return np.full(GRID.shape, 1.0 / (GRID.shape[0] * GRID.shape[1]))


def test_both_sweep_apart_from_each_other_and_see_most_of_the_room(lab_field: ResolvedField, lattice: Lattice) -> None:
    outlook = chosen(lab_field, lattice, even())
    first, second = outlook.stands.values()
    assert math.hypot(first.x - second.x, first.y - second.y) >= search_from_field(lab_field).apart_m
    assert 0.5 < outlook.chance <= 1.0


def test_a_place_beyond_the_first_turn_draws_a_robot_there(lab_field: ResolvedField, lattice: Lattice) -> None:
    """Three metres away: by the views of one turn alone, no stand would show it."""
    chances = np.zeros(GRID.shape)
    chances[int(np.argmin(np.abs(GRID.ys))), int(np.argmin(np.abs(GRID.xs - 3.3)))] = 1.0
    outlook = chosen(lab_field, lattice, chances)
    assert outlook.chance > 0.8
    assert max(stand.x for stand in outlook.stands.values()) > 0.9


def test_nobody_flies_where_it_may_not_be(lab_field: ResolvedField, lattice: Lattice) -> None:
    left = {name: np.where(lattice.places[:, 0] < -1.0, math.inf, -1.0) for name in POSES}
    stands = chosen(lab_field, lattice, even(), left).stands
    assert stands and all(stand.x < -1.0 for stand in stands.values())
    nowhere = {name: np.full(len(lattice.places), -1.0) for name in POSES}
    assert not chosen(lab_field, lattice, even(), nowhere).stands


def test_the_cell_of_each_place_is_that_of_the_grid(lattice: Lattice) -> None:
    rows, columns = lattice.cells(np.array([[GRID.xs[3], GRID.ys[8]], [GRID.xs[-1], GRID.ys[0]]]))
    assert (rows.tolist(), columns.tolist()) == ([8, 0], [3, len(GRID.xs) - 1])
