"""A Tello in a field file: its own video, and the lens and the setting that this needs."""

import pytest

from groundstation.errors import SettingsError
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.schema import Field

FIELD = find_field("lab")
VIDEO = "drones.drone_1.camera={source: 'tello://192.168.1.11', calibration: cameras/tello_front.yaml}"


def field(*options: str) -> Field:
    tello = ("drones.drone_1.kind=tello", "drones.drone_1.tello={}")
    return load_field(FIELD, (*tello, *options))


def test_a_tellos_own_video_needs_a_lens_of_its_size() -> None:
    assert field(VIDEO).drones["drone_1"].camera.calibration.width_px == 960
    refused = r"ardrone_front\.yaml:1: must be for 960 x 720 pixels, as a Tello sends them \(got 640 x 360\)"
    with pytest.raises(SettingsError, match=refused):
        field("drones.drone_1.camera.source=tello://192.168.1.11")


def test_a_tello_that_is_never_asked_for_pictures_cannot_be_the_camera() -> None:
    with pytest.raises(SettingsError, match=r"drones\.drone_1\.tello\.video: must be true for camera\.source tello://"):
        field(VIDEO, "drones.drone_1.tello={video: false}")


def test_another_camera_on_a_tello_has_any_size_and_needs_no_video() -> None:
    other = "drones.drone_1.camera.source=http://192.168.1.61:8080/video.mjpg"
    assert field(other, "drones.drone_1.tello={video: false}").drones["drone_1"].kind == "tello"
