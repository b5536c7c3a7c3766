"""A take-off must end inside the fence, whoever says how high it climbs."""

from pathlib import Path

import pytest

from groundstation.errors import SettingsError
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.vehicles import all_kinds

ROS2 = ("drones.drone_1.kind=ros2", "drones.drone_1.camera.source=http://127.0.0.1:8080/video.mjpg")


def problems(*options: str, field: str = "lab") -> list[str]:
    with pytest.raises(SettingsError) as caught:
        load_field(find_field(field), options)
    return caught.value.problems


@pytest.mark.parametrize("given", ["2.9", "2.81"])
def test_one_above_the_fence_is_refused_with_range_and_remedy(given: str) -> None:
    (fault,) = problems(*ROS2, f"drones.drone_1.ros2={{namespace: drone_1, take_off_m: {given}}}")
    words = (
        f"drones.drone_1.ros2.take_off_m: must be <= 2.8 (room.fence.z_m): lower it, or raise the fence (got {given})"
    )
    assert fault.endswith(words)


def test_a_height_that_the_file_leaves_out_counts_too() -> None:
    found = problems(*ROS2, "drones.drone_2.enabled=false", "room.fence.z_m=[0.0, 0.78]")
    assert any("drones.drone_1.ros2.take_off_m: must be <= 0.78" in line for line in found), found


def test_mavlink_vehicles_climb_to_a_height_of_the_file(tmp_path: Path) -> None:
    section = "{flavour: px4, system_id: 11, take_off_m: 2.9}"
    found = problems("drones.drone_1.kind=mavlink", f"drones.drone_1.mavlink={section}")
    assert any("drones.drone_1.mavlink.take_off_m: must be <= 2.8" in line for line in found), found


def test_an_ardrone_climbs_to_a_height_of_its_own() -> None:
    found = problems("room.fence.z_m=[0.0, 0.8]")
    words = "room.fence.z_m[1]: must be >= 0.82, the height to which drone_1 (ardrone) takes off by itself (got 0.8)"
    assert any(line.endswith(words) for line in found), found


def test_a_height_inside_the_fence_is_good_and_a_parked_drone_has_none() -> None:
    load_field(find_field("lab"), (*ROS2, "drones.drone_1.ros2={namespace: drone_1, take_off_m: 2.8}"))
    own = "drones.drone_1.ros2={namespace: drone_1, take_off_m: 3.0}"
    load_field(find_field("lab"), (*ROS2, own, "drones.drone_1.enabled=false"))


def test_each_kind_names_a_key_of_its_own() -> None:
    for kind in all_kinds().values():
        if isinstance(kind.take_off, tuple):
            section, key = kind.take_off
            assert key in kind.sections[section].model_fields, kind.name
