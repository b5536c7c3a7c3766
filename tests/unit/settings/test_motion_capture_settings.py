"""Motion capture in a field file: refusals, and the values for driver, estimator and planner."""

import json
from pathlib import Path

import numpy as np
import pytest

from drivers.motion_capture.settings import MotionCaptureSection
from groundstation.errors import SettingsError
from groundstation.estimation.parameters import parameters_from_field
from groundstation.field.room import MotionCapture
from groundstation.flight.composition import process_table
from groundstation.flight.flight_plan import plan_of
from groundstation.sensing.from_field import sensors_from_field
from groundstation.settings.cautions import cautions
from groundstation.settings.document import dotted
from groundstation.settings.load import load_field
from groundstation.settings.motion_capture import MotionCaptureSettings
from groundstation.settings.resolved import resolved_field
from groundstation.settings.sections import driver_sections, rerouted

CONFIG = Path(__file__).parents[3] / "config"
ROOTED, JUDGED = CONFIG / "mocap-lab.yaml", CONFIG / "mocap-truth.yaml"


def section(path: Path, options: tuple[str, ...] = ()) -> MotionCaptureSection:
    field = load_field(path, options)
    (own,) = [one for one in driver_sections(field) if one.name == "mocap"]
    return MotionCaptureSection.model_validate_json(own.section)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("truth.from=vicon",), "truth.from: must name a motion capture system of the field: mocap (got vicon)"),
        (("truth.from=mocap",), "at least one camera, or a motion capture system that is not the truth"),
        (("motion_capture.mocap.source=http://1.2.3.4",), "must be an address such as natnet://"),
        (("motion_capture.mocap.source=vicon://1.2.3.4:802",), "must have no port: vicon:// is heard at port 801 only"),
        (("motion_capture.mocap.source=vrpn://1.2.3.4:3884",), "must have no port: vrpn:// is heard at port 3883 only"),
        (("motion_capture.mocap.bodies.ghost={}",), "ghost is no drone or target of the field"),
        (("motion_capture.mocap.bodies={drone_1: {name: a}, drone_2: {name: a}}",), "the body's name a is already"),
        (("motion_capture.mocap.bodies={drone_1: {name: drone_2}}",), "name drone_2 is already that of drone_2"),
        (("motion_capture.mocap.bodies={drone_1: {name: turtlebot}}",), "name turtlebot is already that of turtlebot"),
    ],
)
def test_a_wrong_system_is_refused_with_its_place(options: tuple[str, ...], told: str) -> None:
    with pytest.raises(SettingsError) as refused:
        load_field(ROOTED, options)
    assert told in str(refused.value)


@pytest.mark.parametrize("fault", ["drones.drone_1.address=nowhere", "target.marker=none"])
def test_a_body_of_a_faulty_entry_is_no_second_mistake(fault: str) -> None:
    bodies = "motion_capture.mocap.bodies={drone_1: {}, turtlebot: {}}"
    with pytest.raises(SettingsError) as refused:
        load_field(ROOTED, (fault, bodies))
    assert len(refused.value.problems) == 1


def test_a_body_of_a_drone_that_does_not_fly_is_free_for_another() -> None:
    assert load_field(
        ROOTED, ("drones.drone_2.enabled=false", "motion_capture.mocap.bodies={drone_1: {name: drone_2}}")
    )


def test_bodies_may_have_each_other_s_names() -> None:
    own = section(ROOTED, ("motion_capture.mocap.bodies={drone_1: {name: drone_2}, drone_2: {name: drone_1}}",))
    assert [body.name for body in own.bodies] == ["drone_2", "drone_1", "turtlebot"]


def test_the_driver_observes_robots_and_knows_all_bodies_by_name() -> None:
    own = section(ROOTED, ("motion_capture.mocap.bodies.drone_1={name: cf1, position_m: [0.0, 0.0, 0.05]}",))
    assert own.observed == ("drone_1", "drone_2")
    assert [(body.entity, body.name) for body in own.bodies] == [
        ("drone_1", "cf1"), ("drone_2", "drone_2"), ("turtlebot", "turtlebot"),
    ]  # fmt: skip
    assert own.bodies[0].marker_m == (0.0, 0.0, 0.08) and own.bodies[2].marker_m == (0.0, 0.0, 0.4)
    assert own.volume_m == ((-3.5, 3.5), (-2.6, 2.6), (-0.1, 2.7))


def test_the_truth_observes_nobody_and_no_part_of_the_core_knows_it() -> None:
    assert section(JUDGED).observed == ()
    field = load_field(JUDGED)
    resolved = resolved_field(field)
    parameters = parameters_from_field(resolved)
    assert "mocap" not in parameters.entities and "mocap" not in parameters.sensors
    assert set(sensors_from_field(resolved).world) == {"ceiling"} == set(plan_of(field, None, asks=False).cameras)


def test_the_planner_counts_on_the_box() -> None:
    suite = sensors_from_field(resolved_field(load_field(ROOTED)))
    for point, inside in (
        ((0.0, 0.0, 1.6), True),
        ((3.3, 2.4, 2.5), True),
        ((3.3, 2.4, 0.1), True),
        ((3.7, 0, 1), False),
    ):
        assert suite.world_in_view("mocap", np.array(point)) is inside
    eye = suite.world["mocap"]
    assert eye.noise.position_std_m(0.0) == eye.noise.position_std_m(200.0) < 0.01
    ((low, high),) = [view.x_m for view in suite.root_views(1.5)]
    assert (low, high) == pytest.approx((-3.4, 3.4), abs=0.05)


def test_the_estimator_takes_its_axes_for_the_worlds_with_their_own_error() -> None:
    parameters = parameters_from_field(resolved_field(load_field(ROOTED)))
    mean, variances = parameters.entities["mocap"].prior()
    assert not mean.any() and variances[0] == pytest.approx(0.005**2)
    assert parameters.sensors["mocap"].carrier == "mocap" and not parameters.sensors["mocap"].observes_targets


def test_a_simulation_speaks_natnet_whatever_the_system_is(tmp_path: Path) -> None:
    field = load_field(ROOTED, ("motion_capture.mocap.source=vicon://10.0.0.2",))
    moved = rerouted(field, {}, {}, captures={"mocap": ("127.64.1.60", 8080)})
    assert moved.motion_capture["mocap"].source == "natnet://127.64.1.60:8080"
    table = {
        spec.name: spec for spec in process_table(moved, "tcp/127.0.0.1:1", tmp_path, simulation=None, monitor=False)
    }
    assert table["mocap"].entry == "drivers.motion_capture.driver:run" and table["mocap"].role == "camera"
    assert json.loads(table["mocap"].section)["source"] == "natnet://127.64.1.60:8080"


def test_pads_in_its_box_are_in_view() -> None:
    assert not list(cautions(load_field(ROOTED)))
    narrow = load_field(ROOTED, ("motion_capture.mocap.volume_m.x_m=[0.0, 3.5]",))
    assert ["in view of nothing fixed" in text for _, text in cautions(narrow)] == [True, True]


@pytest.mark.parametrize(
    ("options", "path", "words"),
    [
        (("position_m=[150,0,0]",), "position_m", "is beyond the room (got 150): is this in metres?"),
        (("yaw_deg=1.5708",), "yaw_deg", "(got 1.5708): is this in radians"),
        (("yaw_deg=-3.142",), "yaw_deg", "in radians"),
        (("bodies={drone_1: {yaw_deg: 0.785}}",), "bodies.drone_1.yaw_deg", "in radians"),
        (("source=natnet://10.0.0.2:1511",), "source", "asks at port 1511, to which frames are sent"),
        (("volume_m.z_m=[-2600,2600]",), "volume_m.z_m", "is this in metres?"),
        (("up=y", "volume_m.y_m=[-0.1,2.7]", "volume_m.z_m=[-2.6,2.6]"), "volume_m.z_m", "exchange y_m and z_m"),
    ],
)
def test_a_foolish_setting_is_named_with_its_path(options: tuple[str, ...], path: str, words: str) -> None:
    field = load_field(ROOTED, tuple(f"motion_capture.mocap.{option}" for option in options))
    found = [(dotted(at), text) for at, text in cautions(field)]
    assert [words in text for at, text in found if at == f"motion_capture.mocap.{path}"] == [True], found


@pytest.mark.parametrize("option", ["yaw_deg=1.5", "yaw_deg=0", "source=natnet://10.0.0.2", "position_m=[-4,3,0]"])
def test_likely_settings_give_no_caution(option: str) -> None:
    assert not list(cautions(load_field(ROOTED, (f"motion_capture.mocap.{option}",))))


def test_field_and_settings_have_the_same_defaults() -> None:
    written = MotionCaptureSettings.model_validate_json(
        '{"source": "natnet://1.2.3.4", "volume_m": {"x_m": [0, 1], "y_m": [0, 1], "z_m": [0, 1]}}'
    ).model_dump()
    for name in set(MotionCapture.__struct_fields__) - {"source", "volume_m", "bodies"}:
        assert written[name] == MotionCapture.__struct_defaults__[MotionCapture.__struct_fields__[2:].index(name)], name
