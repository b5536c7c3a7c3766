"""A search flies at the height from which turning cameras see most of the floor."""

from dataclasses import replace as replaced
from pathlib import Path

import msgspec

from groundstation.control.parameters import control_from_field
from groundstation.control.search_height import search_height_m
from groundstation.control.search_ranges import search_ranges_m, searching_cameras
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


def test_returning_and_searching_robots_fly_at_the_search_height() -> None:
    assert control_from_field(LAB).search_height_m == search_height_m(LAB)


def test_cameras_without_a_range_stay_as_they_are() -> None:
    onboard = sensors_from_field(LAB).onboard
    cameras = searching_cameras(onboard, {"drone_1": 3.0})
    assert cameras["drone_1"].view.range_m == 3.0
    assert cameras["drone_2"] is onboard["drone_2"]
    assert replaced(cameras["drone_1"], view=onboard["drone_1"].view) == onboard["drone_1"]
