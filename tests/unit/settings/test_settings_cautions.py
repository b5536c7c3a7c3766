"""Legal but unwise settings give a caution with its place, and no refusal."""

import re
from pathlib import Path

import pytest

from groundstation.settings.files import SHIPPED
from groundstation.settings.load import cautions_of, load_field
from groundstation.settings.wording import told

LAB = Path(__file__).parents[2] / "fixtures" / "field" / "lab.yaml"
LENS = (LAB.parent / "cameras" / "ceiling.yaml").read_text()


@pytest.mark.parametrize("name", ["lab", "mixed-team", "mocap-lab", "mocap-truth", "two-targets", "uwb-lab"])
def test_shipped_fields_are_no_cause_for_caution(name: str) -> None:
    assert cautions_of(SHIPPED / f"{name}.yaml") == []


FOOLISH = [
    ("cameras.ceiling.rotation_deg=[80,0,0]", "cameras.ceiling.rotation_deg", "at the walls or the ceiling"),
    ("cameras.ceiling.rotation_deg=[45,0,0]", "cameras.ceiling.position_m", "leave no pad in its view"),
    ("drones.drone_1.pad_m=[-3.0,2.0]", "drones.drone_1.pad_m", "in view of nothing fixed"),
    ("drones.drone_1.pad_m=[-0.45,0.85]", "drones.drone_1.pad_m", "1 m above it, no fixed camera sees a whole marker"),
    ("drones.drone_1.camera.tilt_down_deg=-45", "drones.drone_1.camera.tilt_down_deg", "seen from above only"),
    ("room.fence.x_m=[-0.95,3.7]", "drones.drone_1.pad_m", "0.05 m from the fence"),
    ("room.fence.x_m=[-1.6,-0.7]", "room.fence.x_m", "leaves 0.90 m"),
    (
        "room.obstacles={pillar: {centre_m: [-1.75, 0.5], size_m: [1, 1, 2]}}",
        "drones.drone_1.pad_m",
        "is 0.35 m from room",
    ),
    ("safety.max_position_std_m=0.01", "safety.max_position_std_m", "would hover all the time"),
    ("drones.drone_1.address=192.168.1.255", "drones.drone_1.address", "not the address of a single vehicle"),
    ("drones.drone_1.address=224.0.0.1", "drones.drone_1.address", "not the address of a single vehicle"),
    ("recording.directory=/dev/null/runs", "recording.directory", "cannot be written"),
    ("recording.directory=~/runs", "recording.directory", "not your home"),
    ("cameras.ceiling.video_delay_ms=0.12", "cameras.ceiling.video_delay_ms", "(got 0.12): is this in seconds"),
    ("drones.drone_2.camera.video_delay_ms=0.12", "drones.drone_2.camera.video_delay_ms", "in seconds"),
    ("drones.drone_1.odometry.height_delay_ms=0.085", "drones.drone_1.odometry.height_delay_ms", "in seconds"),
    ("drones.drone_1.odometry.height_std_m=10", "drones.drone_1.odometry.height_std_m", "counts for nothing"),
    ("drones.drone_1.odometry.attitude_std_deg=0.017", "drones.drone_1.odometry.attitude_std_deg", "in radians"),
    ("drones.drone_1.limits.max_yaw_rate_deg_s=1.05", "drones.drone_1.limits.max_yaw_rate_deg_s", "in radians"),
    ("drones.drone_1.limits.max_speed_m_s=0.0006", "drones.drone_1.limits.max_speed_m_s", "hardly move"),
    ("cameras.ceiling.attitude_std_deg=0.0035", "cameras.ceiling.attitude_std_deg", "in radians"),
    ("estimator.max_lateness_s=1e-3", "estimator.max_lateness_s", "would be refused"),
    ("planner.planned_range_m=0.019", "planner.planned_range_m", "no sighting at all"),
    ("planner.planned_range_m=8", "planner.planned_range_m", "2.5 px in the picture of drone_1's camera"),
    (
        "defaults.marker.square_mm=12",
        "defaults.marker.square_mm",
        "too small for ceiling (got 12): on a pad they have 3.4 px",
    ),
    ("planner.level_heights_m=[[2.6],[2.7,2.5]]", "planner.level_heights_m", "2.1 m over the target"),
    ("room.fence.x_m=[-4,3.7]", "room.fence.x_m", "within 0.00 m of a wall"),
    ("room.fence.z_m=[0,4.15]", "room.fence.z_m", "within 0.05 m of a fixed camera"),
    ("recording.directory=" + "x" * 300, "recording.directory", "File name too long"),
    ("drones.drone_1.odometry.yaw_rate_std_deg_s=0.0017", "drones.drone_1.odometry.yaw_rate_std_deg_s", "in radians"),
    ("drones.drone_1.pad_yaw_deg=1.5708", "drones.drone_1.pad_yaw_deg", "(got 1.5708): is this in radians"),
    (
        "target.odometry={source: 'ros2://10.0.0.9/odom', delay_ms: 0.02}",
        "target.odometry.delay_ms",
        "(got 0.02): is this in seconds",
    ),
    ("planner.step_s=2e-4", "planner.step_s", "0.002 s ahead"),
    ("cameras.ceiling.source=/dev/video97", "cameras.ceiling.source", "not there on this machine"),
]


def test_devices_of_another_host_are_not_looked_for_here() -> None:
    device = ("bus.listen=192.168.1.5", "cameras.ceiling.source=/dev/video97", "cameras.ceiling.host=lab_pc_2")
    assert [line for line in cautions_of(LAB, device) if "not there" in line] == []


@pytest.mark.parametrize(("centre", "height"), [("[2, 1]", 0.8), ("[3.85, 0]", 2.0), ("[2, 1]", 2.0)])
def test_obstacles_away_from_the_pads_give_no_caution(centre: str, height: float) -> None:
    option = f"room.obstacles={{table: {{centre_m: {centre}, size_m: [0.2, 1, {height}]}}}}"
    assert cautions_of(LAB, [option]) == cautions_of(LAB)


@pytest.mark.parametrize(("option", "path", "words"), FOOLISH)
def test_a_foolish_setting_is_named_with_its_path(option: str, path: str, words: str) -> None:
    options = [option]
    if "address" in option:
        options.append("drones.drone_1.camera.source=http://192.168.1.11/video.mjpg")
    load_field(LAB, options)
    found = cautions_of(LAB, options)
    assert any(path in line and words in line for line in found), found


def cautions_with(folder: Path, ceiling: str) -> list[str]:
    """Return the cautions about the lab with another calibration file of the ceiling camera."""
    (folder / "cameras").mkdir()
    for lens in (LAB.parent / "cameras").glob("*.yaml"):
        (folder / "cameras" / lens.name).write_text(lens.read_text())
    (folder / "cameras" / "ceiling.yaml").write_text(ceiling)
    (folder / "lab.yaml").write_text(LAB.read_text())
    return cautions_of(folder / "lab.yaml")


def stds(fx_px: float) -> str:
    others = ", ".join(f"{name}: 0.1" for name in ("fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"))
    return f"{LENS}std: {{fx_px: {fx_px}, {others}}}\n"


@pytest.mark.parametrize(
    ("ceiling", "words"),
    [
        (LENS.replace("residual_px: 0.2", "residual_px: 0.6"), "residual_px: says that the lens fits .* (got 0.6, "),
        (stds(30.0), "std: leaves the focal length uncertain by 3%, .* tilted by 20 to 40 degrees"),
    ],
)
def test_a_lens_that_its_own_calibration_calls_inexact_is_named(tmp_path: Path, ceiling: str, words: str) -> None:
    (line,) = cautions_with(tmp_path, ceiling)
    assert re.search(words.replace("(", r"\("), line), line


@pytest.mark.parametrize("ceiling", [LENS.replace("residual_px: 0.2", "residual_px: 0.5"), stds(23.0)])
def test_a_usual_lens_gives_no_caution(tmp_path: Path, ceiling: str) -> None:
    assert cautions_with(tmp_path, ceiling) == []


@pytest.mark.parametrize(
    ("distortion", "words"),
    [
        ("[0.2, -2.0, 0.0, 0.0, -3.0]", "folds the picture"),
        ("[50.0, 0.0, 0.0, 0.0, 0.0]", "moves the picture's corners"),
        ("[0.0, 0.0, 3.0, 0.0, 0.0]", "moves the picture's corners"),
    ],
)
def test_a_lens_that_no_camera_has_is_named_where_it_is_written(tmp_path: Path, distortion: str, words: str) -> None:
    folded = re.sub("distortion: .*", f"distortion: {distortion}", LENS)
    (line,) = cautions_with(tmp_path, folded)
    one = told(line, "WARNING")
    assert one.file.endswith("cameras/ceiling.yaml") and one.line == LENS[: LENS.index("distortion:")].count("\n") + 1
    assert one.path == "distortion" and words in one.text


def test_a_finding_is_taken_apart_for_programs() -> None:
    assert told("/a/lab.yaml:37: drones.drone_1.pad_m[0]: must be so", "ERROR") == (
        "/a/lab.yaml",
        37,
        "drones.drone_1.pad_m[0]",
        "ERROR",
        "must be so",
    )
    assert told("there is no scenario 'x'", "ERROR") == ("", 0, "", "ERROR", "there is no scenario 'x'")
