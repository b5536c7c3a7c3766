"""Sections of the processes; simulation changes addresses only."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.ardrone.settings import ArDroneDriverSettings
from drivers.camera.settings import CameraDriverSettings
from groundstation.field.room import Fence
from groundstation.settings.behaviour import SafetySettings
from groundstation.settings.drones import LimitSettings
from groundstation.settings.load import load_field
from groundstation.settings.schema import Field
from groundstation.settings.sections import CAMERA, core_section, driver_sections, rerouted
from groundstation.vehicles import kind_named
from sim_bridge.conformance.subject import subject_of

FIXTURE = Path(__file__).parents[2] / "fixtures" / "field" / "lab.yaml"
CONFIG = Path(__file__).parents[3] / "config"


@pytest.fixture(scope="module")
def field() -> Field:
    return load_field(FIXTURE)


def cameras(field: Field) -> dict[str, CameraDriverSettings]:
    return {
        section.name: CameraDriverSettings.model_validate_json(section.section)
        for section in driver_sections(field)
        if section.kind == CAMERA
    }


def drones(field: Field) -> dict[str, ArDroneDriverSettings]:
    return {
        section.name: ArDroneDriverSettings.model_validate_json(section.section)
        for section in driver_sections(field)
        if section.kind == "ardrone"
    }


def test_one_driver_for_each_link(field: Field) -> None:
    sections = driver_sections(field)
    assert [(section.name, section.entity, section.kind) for section in sections] == [
        ("drone_1", "drone_1", "ardrone"),
        ("drone_2", "drone_2", "ardrone"),
        ("ceiling", "ceiling", CAMERA),
        ("drone_1_camera", "drone_1", CAMERA),
        ("drone_2_camera", "drone_2", CAMERA),
    ]


def test_a_drone_s_driver_gets_its_limits_and_times(field: Field) -> None:
    settings = drones(field)["drone_1"]
    assert settings.address == "192.168.1.11"
    assert settings.limits.model_dump() == field.drones["drone_1"].limits.model_dump()
    odometry = field.drones["drone_1"].odometry
    assert settings.velocity_scale == odometry.velocity_scale
    assert settings.velocity_std_m_s == odometry.velocity_std_m_s
    assert settings.safety.land_after_s == field.safety.land_after_s
    assert settings.flight.altitude_max_m == field.room.fence.z_m[1]


LIMITS = LimitSettings(
    max_speed_m_s=0.5, max_climb_m_s=0.3, max_yaw_rate_deg_s=50.0, max_tilt_deg=11.0, battery_min=0.2,
    battery_hold_s=4.0,
)  # fmt: skip
SILENCE = SafetySettings(setpoint_lifetime_ms=250, land_after_s=4.0, unseen_land_after_s=9.0)


def test_every_limit_reaches_every_driver() -> None:
    """A limit absent from a driver's section would have the driver's default in flight."""
    field = load_field(CONFIG / "mixed-team.yaml")
    assert not LIMITS.model_dump().items() & LimitSettings().model_dump().items()
    team = {name: drone.model_copy(update={"limits": LIMITS}) for name, drone in field.drones.items()}
    sections = driver_sections(field.model_copy(update={"drones": team, "safety": SILENCE}))
    for section in sections:
        if section.kind == CAMERA:
            continue
        settings = json.loads(section.section)
        assert settings["safety"].pop("fence_m") == list(field.room.fence.model_dump(mode="json").values())
        assert settings["safety"].items() <= SILENCE.model_dump().items()
        if section.kind == "ardrone":
            assert settings["limits"] == LIMITS.model_dump()
        else:
            assert [one["limits"] for one in settings["vehicles"]] == [LIMITS.model_dump(exclude={"max_tilt_deg"})]
    assert {section.kind for section in sections} == {"ardrone", "mavlink", "camera"}


@pytest.mark.parametrize("kind", ["ardrone", "mavlink", "tello", "ros2"])
def test_every_kind_knows_the_fence(kind: str) -> None:
    """A driver without one would not stop a vehicle that leaves it."""
    fence = Fence(x_m=(-2.0, 3.0), y_m=(-1.0, 1.5), z_m=(0.0, 2.2))
    order = replace(subject_of(kind).order(), fence=fence)
    (process,) = kind_named(kind).processes([order])
    assert json.loads(process.section)["safety"]["fence_m"] == [[-2.0, 3.0], [-1.0, 1.5], [0.0, 2.2]]


def test_neighbours_do_not_hear_each_other_s_ultrasound(field: Field) -> None:
    assert [settings.flight.ultrasound_freq for settings in drones(field).values()] == [7, 8]


def test_fixed_cameras_report_robots_only(field: Field) -> None:
    ceiling = cameras(field)["ceiling"]
    assert ceiling.mount.in_world
    assert {marker.entity for marker in ceiling.expected_markers} == {"drone_1", "drone_2"}
    all_seeing = load_field(FIXTURE, ["cameras.ceiling.observes=[robots, targets]"])
    assert {m.entity for m in cameras(all_seeing)["ceiling"].expected_markers} == {"drone_1", "drone_2", "turtlebot"}


def test_a_carried_camera_reports_all_but_its_carrier(field: Field) -> None:
    carried = cameras(field)["drone_1_camera"]
    assert (carried.observer, carried.mount.tilt_down_deg) == ("drone_1", 45)
    assert {marker.entity for marker in carried.expected_markers} == {"drone_2", "turtlebot"}
    (target,) = [marker for marker in carried.expected_markers if marker.entity == "turtlebot"]
    assert (target.position_m, target.square_mm, target.kind) == ((0, 0, 0.4), 44, "target")
    assert carried.calibration.intrinsics().width_px == 640


def test_full_searches_are_staggered(field: Field) -> None:
    phases = [camera.search_phase_s for camera in cameras(field).values()]
    assert phases == sorted(set(phases))
    assert max(phases) < 1 / 2.0


def test_simulation_changes_addresses_only(field: Field) -> None:
    addresses = {"drone_1": "127.3.7.11", "drone_2": "127.3.7.12"}
    streams = {"ceiling": ("127.3.7.50", 8080), "drone_1": ("127.3.7.51", 8080), "drone_2": ("127.3.7.52", 8080)}
    flown = [json.loads(section.section) for section in driver_sections(field)]
    simulated = [json.loads(section.section) for section in driver_sections(rerouted(field, addresses, streams))]
    for real, emulated in zip(flown, simulated, strict=True):
        assert {key for key in real if real[key] != emulated[key]} <= {"address", "source"}
    assert simulated[0]["address"] == "127.3.7.11"
    assert simulated[2]["source"] == "http://127.3.7.50:8080/video.mjpg"
    assert simulated[4]["source"] == "http://127.3.7.52:8080/video.mjpg"
    assert field.drones["drone_1"].address == "192.168.1.11", "the field itself is a value"
    with pytest.raises(KeyError):
        rerouted(field, {"drone_9": "127.0.0.1"}, {})


def test_simulation_speaks_to_a_drone_s_own_video_as_the_field_does(tmp_path: Path) -> None:
    text = FIXTURE.read_text(encoding="utf-8").replace("http://192.168.1.51:8080/video.mjpg", "ardrone://192.168.1.11")
    (tmp_path / "lab.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "cameras").symlink_to(FIXTURE.parent / "cameras")
    field = load_field(tmp_path / "lab.yaml")
    streams = {"drone_1": ("127.3.7.11", 5555), "drone_2": ("127.3.7.52", 8080)}
    emulated = cameras(rerouted(field, {"drone_1": "127.3.7.11"}, streams))
    assert emulated["drone_1_camera"].source == "ardrone://127.3.7.11:5555"
    assert emulated["drone_2_camera"].source == "http://127.3.7.52:8080/video.mjpg"


def test_the_core_gets_the_whole_field(field: Field) -> None:
    section = json.loads(core_section(field, "runs/x", 3))
    assert (section["run_dir"], section["epoch"]) == ("runs/x", 3)
    assert Field.model_validate(section["field"], strict=False) == field
    assert Field.model_validate_json(json.dumps(section["field"])) == field
