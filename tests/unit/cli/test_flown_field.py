"""Whether the field file that a calibration shall change is that of the flight."""

import pytest

from groundstation.cli.flown_field import differing
from groundstation.errors import OperatorMistake
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field

LAB = find_field("lab")


def test_the_flown_field_differs_in_nothing() -> None:
    assert differing("lab.yaml", load_field(LAB), load_field(LAB)) == ""


def test_settings_that_differ_are_named_with_both_values() -> None:
    changed = ("drones.drone_1.pad_m=[0.3, 0.4]", "planner.hysteresis=0.2")
    told = differing("mine.yaml", load_field(LAB, changed), load_field(LAB))
    was = load_field(LAB).drones["drone_1"].pad_m
    assert told == f"mine.yaml has drones.drone_1.pad_m [0.3, 0.4] (flown: {list(was)})"


def test_many_differences_are_counted() -> None:
    sizes = [f"drones.{name}.pad_m=[{x}, 0.9]" for name, x in (("drone_1", 0.1), ("drone_2", 1.2))]
    moved = [f"cameras.ceiling.{key}=0.07" for key in ("position_std_m",)]
    lens = [f"drones.{name}.camera.tilt_down_deg={tilt}" for name, tilt in (("drone_1", 41), ("drone_2", 42))]
    more = ["cameras.ceiling.position_m=[0.1, 0.1, 4.0]", "target.marker.height_m=0.35"]
    told = differing("mine.yaml", load_field(LAB, sizes + moved + lens + more), load_field(LAB))
    assert told.endswith(" and 2 others") and told.count("flown: ") == 5


@pytest.mark.parametrize("option", ["target.name=ghost", "drones.drone_2=null"])
def test_a_field_of_another_team_is_refused(option: str) -> None:
    with pytest.raises(
        OperatorMistake, match=r"other.yaml: is not the field of this flight: it has .*; the flight had "
    ):
        differing("other.yaml", load_field(LAB, (option,)), load_field(LAB))
