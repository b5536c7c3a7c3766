"""Valid field files: three levels, options, and the forms of the resolved field."""

import json
import math
import shutil
from pathlib import Path

import pytest

from groundstation.errors import SettingsError
from groundstation.geometry.board import VALID_CODES
from groundstation.settings.document import SourceLine, dotted, parse
from groundstation.settings.drawing import footprint, level_heights, marker_height, paths_of
from groundstation.settings.files import SHIPPED, find_field, find_scenario
from groundstation.settings.json_schema import field_file_schema
from groundstation.settings.levels import merged
from groundstation.settings.load import load_field
from groundstation.settings.resolved import summary_of, yaml_of
from groundstation.settings.scenario import Room, load_scenario
from groundstation.settings.schema import Field
from sim_bridge.fault_kinds import FaultKind

ROOT = Path(__file__).parents[3]
FIXTURE = ROOT / "tests" / "fixtures" / "field" / "lab.yaml"


@pytest.fixture(scope="module")
def field() -> Field:
    return load_field(FIXTURE)


def test_the_field_that_is_flown_is_sound() -> None:
    flown = load_field(ROOT / "config" / "lab.yaml")
    assert list(flown.drones) == ["drone_1", "drone_2"]
    assert all(camera.observes == ("robots",) for camera in flown.cameras.values()), "fixed cameras see no target"


def test_levels_are_merged_and_calibrations_read_in(field: Field) -> None:
    drone = field.drones["drone_2"]
    assert drone.kind == "ardrone"
    assert (drone.limits.max_speed_m_s, drone.odometry.velocity_scale) == (0.6, 1.18)
    assert (drone.marker.code, drone.marker.square_mm, drone.marker.position_m) == (2, 44, (0, 0, 0.08))
    assert (drone.camera.calibration.fx_px, drone.camera.source) == (460, "http://192.168.1.52:8080/video.mjpg")
    assert {name: drone.marker.code for name, drone in field.drones.items()} == {"drone_1": 1, "drone_2": 2}


@pytest.mark.parametrize(
    ("options", "speed"),
    [
        ((), 0.6),
        (("defaults.limits.max_speed_m_s=0.5",), 0.5),
        (("defaults.limits.max_speed_m_s=0.5", "types.ardrone_2.limits.max_speed_m_s=0.4"), 0.4),
        (("drones.drone_1.limits.max_speed_m_s=0.3", "types.ardrone_2.limits.max_speed_m_s=0.4"), 0.3),
        (("defaults.limits.max_speed_m_s=0.5", "defaults.limits.max_speed_m_s=0.2"), 0.2),
    ],
)
def test_robot_beats_type_beats_defaults_and_the_last_option_wins(options: tuple[str, ...], speed: float) -> None:
    assert load_field(FIXTURE, options).drones["drone_1"].limits.max_speed_m_s == speed


def test_options_reach_everything() -> None:
    options = (
        "planner.level_heights_m.1.0=2.0",
        "room.fence.x_m=[-3, 3]",
        "console={enabled: true, port: 9000}",
        "recording.image_fps=1e0",
        "drones.drone_2.enabled=false",
        "drones.drone_1.limits={max_climb_m_s: 0.2}",
    )
    field = load_field(FIXTURE, options)
    assert field.planner.level_heights_m[1] == (2.0, 1.3)
    assert field.room.fence.x_m == (-3, 3)
    assert (field.console.enabled, field.console.port, field.recording.image_fps) == (True, 9000, 1.0)
    assert list(field.drones) == ["drone_1"]
    assert load_field(FIXTURE, ["drones.drone_2=null"]).drones == load_field(FIXTURE, options[4:5]).drones
    assert (field.drones["drone_1"].limits.max_climb_m_s, field.drones["drone_1"].limits.max_speed_m_s) == (0.2, 0.6)


def test_the_older_name_of_a_planner_mode_is_understood() -> None:
    assert load_field(FIXTURE, ["planner.mode=certified"]).planner.mode == "multistart"


def test_sections_may_be_left_out(tmp_path: Path) -> None:
    text = FIXTURE.read_text(encoding="utf-8")
    kept = text[: text.index("estimator:")] + text[text.index("planner:") : text.index("safety:")]
    shutil.copytree(FIXTURE.parent / "cameras", tmp_path / "cameras")
    (tmp_path / "small.yaml").write_text(kept, encoding="utf-8")
    field = load_field(tmp_path / "small.yaml")
    assert (field.safety.min_separation_m, field.estimator.rate_hz, field.console.enabled) == (0.6, 50, True)


def test_the_field_travels_as_json_and_is_frozen(field: Field) -> None:
    assert Field.model_validate_json(field.model_dump_json()) == field
    with pytest.raises(ValueError, match="frozen"):
        field.site = "elsewhere"


def test_the_resolved_file_is_a_field_file(field: Field, tmp_path: Path) -> None:
    path = tmp_path / "resolved.yaml"
    path.write_text(yaml_of(field), encoding="utf-8")
    assert load_field(path) == field


def test_angles_are_offered_in_radians(field: Field) -> None:
    drone = field.drones["drone_1"]
    assert drone.camera.tilt_down_rad == pytest.approx(math.pi / 4)
    assert drone.limits.max_yaw_rate_rad_s == pytest.approx(math.pi / 3)
    assert field.cameras["ceiling"].attitude_std_rad == pytest.approx(math.radians(0.2))
    view = field.cameras["ceiling"].calibration.horizontal_view_rad
    assert math.degrees(view) == pytest.approx(2 * math.degrees(math.atan(640 / 1179)))


def test_every_valid_marker_code_is_accepted_and_no_other() -> None:
    for code in range(-1, 18):
        option = f"drones.drone_1.marker.code={code}"
        if code in VALID_CODES and code not in (2, 5):
            assert load_field(FIXTURE, [option]).drones["drone_1"].marker.code == code
        else:
            with pytest.raises(SettingsError, match="code"):
                load_field(FIXTURE, [option])


def test_numbers_are_those_of_yaml_1_2() -> None:
    tree = parse("a: 1e-3\nb: no\nc: 12:30\nd: 010\ne: 2026-11-20\nf: ~\n", "x")
    assert tree.plain() == {"a": 0.001, "b": "no", "c": "12:30", "d": 10, "e": "2026-11-20", "f": None}


def test_lines_survive_merging() -> None:
    lower = parse("limits:\n  a: 1\n  b: 2\n", "low")
    upper = parse("# upper\nlimits: {b: 3}\n", "up")
    both = merged(lower, upper)
    assert both.plain() == {"limits": {"a": 1, "b": 3}}
    assert str(both.origin_of(("limits", "a"))) == "low:2"
    assert str(both.origin_of(("limits", "b"))) == "up:2"
    assert both.origin_of(("limits", "c")) == SourceLine("up", 2, ("limits", "c"))
    assert dotted(("drones", "drone_1", "pad_m", 0)) == "drones.drone_1.pad_m[0]"


def test_the_json_schema_knows_every_key_of_the_file() -> None:
    schema = field_file_schema()
    assert json.loads(json.dumps(schema)) == schema
    assert schema["$schema"].endswith("2020-12/schema")
    assert schema["additionalProperties"] is False
    assert set(schema["required"]) == {"schema_version", "site", "room", "drones"}
    fixed = ("cameras", "motion_capture", "ranging")
    assert schema["allOf"] == [{"anyOf": [{"required": [section]} for section in fixed]}]
    assert schema["anyOf"] == [{"required": ["target"]}, {"required": ["targets"]}]
    assert set(schema["properties"]) == {*Field.model_fields, "defaults", "types"}
    definitions = schema["$defs"]
    assert "required" not in definitions["Level"]
    assert set(definitions["Drone"]["properties"]) - set(definitions["Level"]["properties"]) == {"type"}
    limits = definitions["LimitSettings"]["properties"]["max_speed_m_s"]
    assert (limits["maximum"], limits["exclusiveMinimum"]) == (3, 0)
    assert definitions["OnboardCameraSettings"]["properties"]["calibration"]["anyOf"][0] == {"type": "string"}
    assert "required" in definitions["CalibrationSettings"]


def test_the_summary_names_who_wins(field: Field) -> None:
    text = summary_of(field)
    assert "CUT_MOTORS > LAND > HOLD > setpoint > TAKEOFF" in text
    assert "drone drone_1: ardrone at 192.168.1.11" in text
    assert "lands below 15% battery held 3 s" in text


def test_names_of_shipped_files() -> None:
    assert find_field("lab") == SHIPPED / "lab.yaml"
    assert find_field("some/where.yaml") == Path("some/where.yaml")
    assert find_scenario("realistic", FIXTURE) == SHIPPED / "scenarios" / "realistic.yaml"
    with pytest.raises(SettingsError, match="there is no scenario 'realstic', did you mean realistic"):
        find_scenario("realstic", FIXTURE)
    with pytest.raises(SettingsError, match="there is no field file 'hall', there are: lab"):
        find_field("hall")


def test_a_path_that_no_recording_can_name_is_refused() -> None:
    with pytest.raises(SettingsError, match="is no UTF-8 text"):
        find_field("lab\udcff/lab.yaml")


def test_scenarios_are_read_with_options() -> None:
    path = find_scenario("realistic", FIXTURE)
    assert load_scenario(path)["schema_version"] == 1
    assert load_scenario(path, ["seed=7", "cameras.fps=10"])["cameras"]["fps"] == 10


WRONG_SCENARIO = """
schema_version: 1
target:
  path: {shape: figure_eight, speed_m_s: 7,
    half_lenght_m: 3}
cameras:
  fps: 90
  corner_noise: 3
faults:
  - {kind: camera_ct, entity: ceiling, start_s: 1}
"""


def test_scenarios_are_judged_by_the_simulator_and_worded_here(tmp_path: Path) -> None:
    path = tmp_path / "s.yaml"
    path.write_text(WRONG_SCENARIO.lstrip(), encoding="utf-8")
    kinds = [f"'{kind}'" for kind in FaultKind][:-1]
    assert len(kinds) == 35
    with pytest.raises(SettingsError) as caught:
        load_scenario(path, ["cameras.blur_px=20", "seed"])
    assert [problem.removeprefix(f"{path}") for problem in caught.value.problems] == [
        "--set cameras.blur_px=20: cameras.blur_px: must be <= 10 (got 20)",
        "--set seed: must look like path.to.key=value",
        ":3: target.path.speed_m_s: must be <= 5 (got 7)",
        ":4: target.path.half_lenght_m: unknown key, did you mean half_length_m?",
        ":6: cameras.fps: must be <= 60 (got 90)",
        ":7: cameras.corner_noise: unknown key, did you mean corner_noise_px?",
        f":9: faults[0].kind: must be {', '.join(kinds)} or 'odometry_scaled'"
        ' (got "camera_ct"), did you mean camera_cut?',
    ]
    path.write_text("schema_version: 1\ntarget:\n  path: {shape: figure_eigth}\n", encoding="utf-8")
    with pytest.raises(SettingsError) as caught:
        load_scenario(path)
    assert caught.value.problems == [
        f"{path}:3: target.path: shape must be one of 'figure_eight', 'none', 'anywhere', 'waypoints', 'random_walk',"
        " 'sprint', 'along_walls' (got \"figure_eigth\"), did you mean figure_eight?"
    ]


def test_a_scenario_names_only_what_its_field_has(tmp_path: Path, field: Field) -> None:
    path = tmp_path / "s.yaml"
    path.write_text(
        "targets:\n  roomba: {path: {shape: none}}\nfaults:\n"
        "  - {kind: velocity_stuck, entity: drone_9, start_s: 1, value: 0}\n"
        "  - {kind: picture_frozen, entity: ceiling, start_s: 1}\n"
        "  - {kind: picture_frozen, entity: drone_2, start_s: 1}\n",
        encoding="utf-8",
    )
    load_scenario(path)
    with pytest.raises(SettingsError) as caught:
        load_scenario(path, room=Room(field))
    unknown = [
        f"{path}:2: targets.roomba: there is no such target, only turtlebot",
        f"{path}:4: faults[0].entity: 'drone_9' is none of drone_1, drone_2",
    ]
    assert caught.value.problems == unknown
    with pytest.raises(SettingsError) as caught:
        load_scenario(path, room=Room(field, ["drone_1"], ["ceiling", "drone_2"]))
    assert caught.value.problems == [
        unknown[0],
        f"{path}:4: faults[0].entity: 'drone_9' is none of drone_2",
        f"{path}:5: faults[1].entity: 'ceiling' is none of drone_1",
        f"{path}:6: faults[2].entity: 'drone_2' is none of drone_1",
    ]


def test_the_drawing_is_to_scale(field: Field) -> None:
    ceiling = field.cameras["ceiling"]
    assert level_heights(field) == [2.2, 1.3]
    assert marker_height(field, 2.2) == pytest.approx(2.28)
    assert footprint(ceiling, 2.2) == pytest.approx((2.0 * 640 / 1179, 2.0 * 360 / 1179))
    assert footprint(ceiling, 9.0) == (0, 0)
    eight = {"path": {"shape": "figure_eight", "half_length_m": 3, "half_width_m": 1}}
    paths = paths_of({"target": eight, "targets": {"b": {"path": {"shape": "none"}}}}, ("a", "b"))
    assert max(paths["a"]) == pytest.approx((3, 0))
    assert paths["b"] == []
    along = {"shape": "waypoints", "points_m": [[0, 0], [1, 0]]}
    for after_last, points in (("back", [(0, 0), (1, 0)]), ("first", [(0, 0), (1, 0), (0, 0)])):
        assert paths_of({"target": {"path": along | {"after_last": after_last}}}, ("a",)) == {"a": points}
    assert paths_of({}, ("a",)) == {"a": []}
