"""A search flies where turning cameras see most of the floor; ways back where fixed cameras have an ample view."""

from dataclasses import replace as replaced
from pathlib import Path

import msgspec
import numpy as np
import pytest

from groundstation.control.flight_mode import FlightMode
from groundstation.control.moment import Sight
from groundstation.control.parameters import control_from_field
from groundstation.control.search_height import search_height_m
from groundstation.control.search_ranges import search_ranges_m, searching_cameras
from groundstation.control.setpoints import setpoints_from_plan
from groundstation.control.view import view_of
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, StateLayout
from groundstation.field.resolved import ResolvedField
from groundstation.sensing.footprint import footprint_of, turn_view
from groundstation.sensing.from_field import sensors_from_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

CONFIG = Path(__file__).parents[3] / "config"
LAB = resolved_field(load_field(CONFIG / "lab.yaml"))


def test_other_heights_show_less_of_the_floor_in_a_turn() -> None:
    sensors = sensors_from_field(LAB)
    camera = searching_cameras(sensors.onboard, search_ranges_m(LAB))["drone_1"]
    shown = {
        height: turn_view(footprint_of(camera, 0.1, height, 0.4, sensors.softness))
        for height in (1.1, 1.3, 1.45, 1.6, 1.9)
    }
    assert search_height_m(LAB) == 1.45
    assert max(shown, key=lambda height: shown[height]) == 1.45
    assert shown[1.1] < 0.5 * shown[1.45]


def test_it_is_a_height_that_plans_fly() -> None:
    low = msgspec.structs.replace(LAB.planner, level_heights_m=((1.0,), (1.2, 1.1)))
    assert search_height_m(msgspec.structs.replace(LAB, planner=low)) == 1.2
    one = msgspec.structs.replace(LAB.planner, level_heights_m=((1.7,),))
    assert search_height_m(msgspec.structs.replace(LAB, planner=one)) == 1.7


def under_a_camera(height_m: float) -> ResolvedField:
    """Return the lab with its camera at another height."""
    options = ("room.size_m=[8,6,30]", f"cameras.ceiling.position_m=[0,0,{height_m}]")
    return resolved_field(load_field(CONFIG / "lab.yaml", options))


def test_returning_and_searching_robots_fly_at_the_search_height() -> None:
    control = control_from_field(LAB)
    assert control.search_height_m == control.return_height_m == search_height_m(LAB)
    assert replaced(control, search_height_m=1.2).return_height_m == 1.2


@pytest.mark.parametrize(("camera_m", "return_m"), [(3.6, 1.35), (2.9, 1.1), (29.0, 1.45)])
def test_ways_back_are_flown_where_a_low_camera_has_an_ample_view(camera_m: float, return_m: float) -> None:
    """Of a camera at 2.9 m the view at the height of a search is half a metre wide; one at 29 m sees no drone."""
    control, sensors = control_from_field(under_a_camera(camera_m)), sensors_from_field(under_a_camera(camera_m))
    assert (control.search_height_m, control.return_height_m) == (1.45, return_m)
    wide, narrow = (view_of(2.0, 0.0, "drone_1", height_m, sensors) for height_m in (return_m, control.search_height_m))
    layout = StateLayout().with_entity("drone_1", EntityKind.ROBOT, ROBOT_CORE)
    belief = JointBelief(np.array([2.0, 0.0, control.search_height_m, 0.0]), 0.4**2 * np.eye(4), layout, 0)
    found = setpoints_from_plan(None, belief, ("drone_1",), control, sensors, Sight(9.0, {"drone_1": 9.0}))["drone_1"]
    assert found.phase is FlightMode.RETURN
    assert (found.velocity_m_s[2] < -0.1) is (return_m < control.search_height_m)
    assert wide == narrow or (wide is not None and narrow is not None and wide.x_m[1] > narrow.x_m[1])


def test_cameras_without_a_range_stay_as_they_are() -> None:
    onboard = sensors_from_field(LAB).onboard
    cameras = searching_cameras(onboard, {"drone_1": 3.0})
    assert cameras["drone_1"].view.range_m == 3.0
    assert cameras["drone_2"] is onboard["drone_2"]
    assert replaced(cameras["drone_1"], view=onboard["drone_1"].view) == onboard["drone_1"]
