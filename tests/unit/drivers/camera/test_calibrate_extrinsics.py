"""Extrinsics from floor markers: pictures in, lines for the field file out; and a check whether they still hold."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from floor_pictures import CEILING, HEADINGS, LENS, PLACES, TURN_DEG, corners_of, drawn, files_for, markers
from ruamel.yaml import YAML

from drivers.camera.calibration.extrinsics import Mark, place_camera
from drivers.camera.calibration.static_markers import Steady
from groundstation.bus import codec, keys
from groundstation.bus.api import Sample
from groundstation.bus.messages import Header
from groundstation.bus.topics import IMAGE
from groundstation.cli.main import run
from groundstation.errors import DriverError
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import base_from_tilted_optical, world_from_downward_optical
from groundstation.recording.synthetic import CLOCK, SITE, UNIX_OFFSET_NS, write_turn
from groundstation.recording.timeline import Timeline
from groundstation.recording.writing import RunWriter
from groundstation.settings.load import load_field

CONFIG = Path(__file__).parents[4] / "config"


def other_lens(tmp_path, **figures):
    path = tmp_path / "lens.yaml"
    path.write_text(json.dumps(json.loads(path.read_text()) | figures))


@pytest.fixture
def measured(capsys):
    """Run `calibrate extrinsics`; returns exit code, its YAML, and its whole output."""

    def call(*arguments):
        code = run(["calibrate", "extrinsics", *arguments])
        said = capsys.readouterr()
        return code, YAML(typ="safe").load(said.out), said.out + said.err

    return call


def test_a_turned_ceiling_camera_is_placed_from_pictures(tmp_path, measured):
    picture = drawn(CEILING, LENS, {code: (*PLACES[code], 0.0, HEADINGS[code]) for code in PLACES})
    folder, calibration = files_for(tmp_path, LENS, picture)
    code, lines, said = measured(folder, "--calibration", calibration, *markers())
    assert code == 0, said
    std_m, std_deg = lines["position_std_m"], lines["attitude_std_deg"]
    assert 0.001 <= std_m < 0.02 and 0.01 <= std_deg < 0.5
    assert np.allclose(lines["position_m"], CEILING.translation, atol=4 * std_m)
    assert np.allclose(lines["rotation_deg"], TURN_DEG, atol=4 * std_deg)
    # These lines are valid in a field file.
    from groundstation.settings.room import WorldCameraSettings

    lens = json.loads((tmp_path / "lens.yaml").read_text())
    entry = {"source": "/dev/video0", "calibration": lens | {"distortion": tuple(lens["distortion"])}, **lines}
    WorldCameraSettings.model_validate(entry, strict=False)


def test_the_deviations_told_are_those_of_the_errors():
    """Corner noise and misplaced markers as assumed: errors over their sigmas have unit variance."""
    rng = np.random.default_rng(4)
    scores = []
    for _ in range(12):
        steady = {}
        for code, (x, y) in PLACES.items():
            at = (x + rng.normal(0, 0.005), y + rng.normal(0, 0.005), 0.0)
            steady[code] = Steady(corners_of(code, at=at) + rng.normal(0.0, 0.1, (12, 2)), 0.0, 20, moved=False)
        marks = [Mark(code, (x, y, 0.0)) for code, (x, y) in PLACES.items()]
        found = place_camera(marks, steady, LENS, 44.0, 0.005)
        error = found.pose.translation - CEILING.translation
        scores.append(error @ np.linalg.solve(found.covariance[3:, 3:], error) / 3)
    assert 0.5 < np.mean(scores) < 1.7


def test_a_marker_that_lies_elsewhere_is_named_and_left_out(tmp_path, measured):
    picture = drawn(CEILING, LENS, {code: (*PLACES[code], 0.0, HEADINGS[code]) for code in PLACES})
    folder, calibration = files_for(tmp_path, LENS, picture, 1)
    wrong = {**PLACES, 3: (-0.7, -0.5)}
    code, lines, said = measured(folder, "--calibration", calibration, *markers(wrong))
    assert code == 0 and "marker 3 seems to lie" in said and "left out" in said
    assert np.allclose(lines["position_m"], CEILING.translation, atol=0.03)


def test_an_onboard_camera_is_placed_on_the_bench(tmp_path, measured):
    lens = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5, residual_px=0.1)
    camera = Pose(base_from_tilted_optical(np.radians(43.0), np.radians(2.0)), np.array([0.09, 0.01, 0.02]))
    picture = drawn(camera, lens, {6: (0.75, 0.0, -0.6, 0.0)})
    folder, calibration = files_for(tmp_path, lens, picture)
    code, lines, said = measured(folder, "--calibration", calibration, "--onboard", "--marker=6=0.75,0,-0.6,0")
    assert code == 0, said
    assert lines["tilt_down_deg"] == pytest.approx(43.0, abs=1.0)
    assert lines["pan_left_deg"] == pytest.approx(2.0, abs=1.0)
    assert np.allclose(lines["position_m"], camera.translation, atol=0.02)
    assert 0.01 <= lines["attitude_std_deg"] < 2.0 and 0.001 <= lines["position_std_m"] < 0.05


def test_insufficient_floor_markers_are_refused_with_a_reason(tmp_path, measured):
    picture = drawn(CEILING, LENS, {1: (*PLACES[1], 0.0, 0.3)})
    folder, calibration = files_for(tmp_path, LENS, picture, 1)
    code, _, said = measured(folder, "--calibration", calibration, *markers())
    assert code == 4 and "only marker 1 was seen" in said
    code, _, said = measured(folder, "--calibration", calibration, "--marker=9=0,0")
    assert code == 4 and "none of the markers 9 was seen" in said
    code, _, said = measured(folder, "--calibration", calibration, "--marker=16=0,0", "--marker=2=x")
    assert code == 2 and "--marker 16=0,0: code: must be <= 15 (got 16)" in said
    code, _, said = measured(folder, "--calibration", calibration, "--marker=8=100,100")
    far = "position_m: must lie within 50 m of the origin: places are in metres (got [100.0, 100.0, 0.0])"
    assert code == 2 and f"--marker 8=100,100: {far}" in said
    code, _, said = measured(folder, "--calibration", calibration)
    assert code == 2 and "--markers FILE" in said
    other_lens(tmp_path, width_px=640)
    code, _, said = measured(folder, "--calibration", calibration, *markers())
    assert code == 2 and "1280x720" in said and "640x720" in said


def test_a_layout_file_names_its_mistakes(tmp_path, measured):
    picture = drawn(CEILING, LENS, {code: (*PLACES[code], 0.0, HEADINGS[code]) for code in PLACES})
    folder, calibration = files_for(tmp_path, LENS, picture, 1)
    layout = tmp_path / "floor.yaml"
    entries = [{"code": code, "position_m": [x, y, 0.0]} for code, (x, y) in PLACES.items()]
    layout.write_text(json.dumps({"square_mm": 44.0, "markers": entries}))
    code, lines, _ = measured(folder, "--calibration", calibration, "--markers", str(layout))
    assert code == 0 and np.allclose(lines["position_m"], CEILING.translation, atol=0.02)
    layout.write_text("square_mm: 44\nmarkers:\n  - code: 3\n    position: [1, 1, 0]\n")
    code, _, said = measured(folder, "--calibration", calibration, "--markers", str(layout))
    assert code == 2 and f"{layout}:4" in said and "position_m" in said


def test_a_mirrored_picture_is_told_as_such(tmp_path, measured):
    picture = drawn(CEILING, LENS, {code: (*PLACES[code], 0.0, HEADINGS[code]) for code in PLACES})
    folder, calibration = files_for(tmp_path, LENS, picture[:, ::-1], 1)
    code, _, said = measured(folder, "--calibration", calibration, *markers())
    assert code == 2 and "markers 1, 2, 3, 4 can be read in a mirror only: switch off the camera's flip" in said


def test_nothing_can_be_told_of_no_markers():
    with pytest.raises(DriverError, match="none of the markers 1"):
        place_camera([Mark(1, (0.0, 0.0, 0.0))], {}, LENS, 44.0, 0.005)


@pytest.mark.parametrize(
    ("codes", "scale", "square_mm", "moved"),
    [((1, 2, 3, 4), 1.1, 44.0, 0.0), ((1, 2, 3, 4), 1.0, 40.0, 0.0), ((1, 2, 3), 1.0, 44.0, 0.2)],
)
def test_markers_that_contradict_each_other_place_nothing(codes, scale, square_mm, moved):
    """A tape, or squares, 10 % off blame no single marker; of three, nobody knows which one is wrong."""
    steady = {code: Steady(corners_of(code), 0.05, 20, moved=False) for code in codes}
    places = {
        code: (scale * PLACES[code][0] + (moved if code == 1 else 0.0), scale * PLACES[code][1]) for code in codes
    }
    with pytest.raises(DriverError, match="do not lie to each other as you said"):
        place_camera([Mark(code, (*place, 0.0)) for code, place in places.items()], steady, LENS, square_mm, 0.005)


def lab_with(tmp_path, cameras):
    """Return a copy of the shipped field with these cameras: name -> (source, pose, turn [deg])."""
    field = YAML(typ="safe").load((CONFIG / "lab.yaml").read_text())
    lens = json.loads((tmp_path / "lens.yaml").read_text())
    field["cameras"] = {
        name: {
            "source": str(source),
            "calibration": lens,
            "position_m": [float(value) for value in pose.translation],
            "rotation_deg": list(turn),
        }
        for name, (source, pose, turn) in cameras.items()
    }
    field["types"]["ardrone_2"]["camera"]["calibration"] = str(CONFIG / "cameras" / "ardrone_front.yaml")
    path = tmp_path / "lab.yaml"
    path.write_text(json.dumps(field))
    return str(path)


def test_the_check_holds_until_a_camera_was_moved(tmp_path, capsys):
    laid = {code: (*PLACES[code], 0.0, HEADINGS[code]) for code in (1, 3)}
    folder, calibration = files_for(tmp_path, LENS, drawn(CEILING, LENS, laid), 1)
    said = ["--frames=1", *markers({code: PLACES[code] for code in (1, 3)})]
    field = lab_with(tmp_path, {"ceiling": (folder, CEILING, TURN_DEG)})
    assert run(["calibrate", "check", field, *said]) == 0
    assert "DOES NOT" not in capsys.readouterr().out
    moved = Pose(CEILING.rotation, np.add(CEILING.translation, (0.1, 0.0, 0.0)))
    assert run(["calibrate", "check", lab_with(tmp_path, {"ceiling": (folder, moved, TURN_DEG)}), *said]) == 1
    out = capsys.readouterr().out
    assert "ceiling: has marker 1" in out and "calibrate extrinsics" in out
    # Another mounting is no contradiction to the lens alone, but another lens is.
    assert run(["calibrate", "check", folder, "--calibration", calibration, "--frames=1"]) == 0
    other_lens(tmp_path, distortion=[-0.9, 0.0, 0.0, 0.0, 0.0])
    assert run(["calibrate", "check", folder, "--calibration", calibration, "--frames=1"]) == 1
    assert "lens or focus were changed" in capsys.readouterr().out


def test_the_check_compares_what_two_cameras_have_in_view(tmp_path, capsys):
    laid = {1: (*PLACES[1], 0.0, 0.3)}
    (tmp_path / "a").mkdir()
    first, _ = files_for(tmp_path, LENS, drawn(CEILING, LENS, laid), 1)
    other = Pose(world_from_downward_optical((0.0, 0.0, 0.0)), np.array([0.5, 0.3, 3.5]))
    cv2.imwrite(str(tmp_path / "a" / "0.png"), drawn(other, LENS, laid))
    cameras = {"ceiling": (first, CEILING, TURN_DEG), "second": (tmp_path / "a", other, (0.0, 0.0, 0.0))}
    assert run(["calibrate", "check", lab_with(tmp_path, cameras), "--frames=1"]) == 0
    assert "ceiling and second have marker 1" in capsys.readouterr().out
    cameras["second"] = (
        tmp_path / "a",
        Pose(other.rotation, np.add(other.translation, (0.0, 0.15, 0.0))),
        (0.0, 0.0, 0.0),
    )
    assert run(["calibrate", "check", lab_with(tmp_path, cameras), "--frames=1"]) == 1


def test_the_check_says_what_is_missing(tmp_path, capsys):
    folder, calibration = files_for(tmp_path, LENS, np.full((720, 1280), 120, np.uint8), 1)
    assert run(["calibrate", "check", folder, "--calibration", calibration, "--frames=1"]) == 1
    assert "is unknown: " in capsys.readouterr().out
    assert run(["calibrate", "check", folder, "--calibration", calibration, "--marker=1=0,0"]) == 2
    assert "where a camera hangs is in a field file" in capsys.readouterr().err
    field = lab_with(tmp_path, {"ceiling": (folder, CEILING, TURN_DEG)})
    assert run(["calibrate", "check", field, "--frames=1", "--marker=8=1,1"]) == 1
    assert "is unknown: marker 8: no camera has it in view" in capsys.readouterr().out
    assert run(["calibrate", "check", field, "--marker=8=1,1", "--marker=8=2,1"]) == 2
    assert run(["calibrate", "check", "uwb-lab", "--frames=1"]) == 1
    assert "is unknown: the field has no fixed camera" in capsys.readouterr().out
    assert run(["calibrate", "check", "http://127.0.0.1:9/video.mjpg"]) == 2
    assert "--calibration FILE" in capsys.readouterr().err


def recorded(tmp_path, pictures, turn=TURN_DEG):
    """Write a run of a lab whose ceiling camera took these pictures, five a second; returns its folder."""
    field = load_field(Path(lab_with(tmp_path, {"ceiling": ("/dev/video0", CEILING, turn)})))
    folder = tmp_path / "run"
    folder.mkdir()
    writer = RunWriter(folder, field.model_dump_json().encode(), 1, Timeline(CLOCK, UNIX_OFFSET_NS))
    key = keys.expression(SITE, IMAGE, "ceiling", "ceiling")
    for number, picture in enumerate(pictures):
        stamp_ns = (number + 1) * 200_000_000
        jpeg = cv2.imencode(".jpg", picture)[1].tobytes()
        header = codec.encode(Header(stamp_ns, CLOCK, "ceiling", "ceiling", number))
        write_turn(writer, [Sample(key, jpeg, header)], stamp_ns)
    writer.close()
    return folder


def test_a_recording_is_checked_by_its_first_pictures(tmp_path, capsys):
    laid = {code: (*PLACES[code], 0.0, HEADINGS[code]) for code in (1, 3)}
    files_for(tmp_path, LENS, picture := drawn(CEILING, LENS, laid), 1)
    empty = np.full_like(picture, 120)
    run_dir = str(recorded(tmp_path, [picture, picture, empty]))
    said = ["--frames=2", *markers({code: PLACES[code] for code in (1, 3)})]
    assert run(["calibrate", "check", run_dir, *said]) == 0
    out = capsys.readouterr().out
    assert "holds: ceiling: has marker 3" in out and "DOES NOT" not in out
    # Its pictures alone identify their field, and a marker elsewhere is reported.
    (raw,) = Path(run_dir).glob("raw*.mcap")
    assert run(["calibrate", "check", str(raw), "--frames=2", "--marker=3=-0.7,-0.5"]) == 1
    assert "DOES NOT HOLD: ceiling: has marker 3 20." in capsys.readouterr().out
    (state,) = Path(run_dir).glob("state*.mcap")
    assert run(["calibrate", "check", str(state)]) == 1
    assert "no picture of it is in the recording" in capsys.readouterr().out
    (tmp_path / "other.mcap").write_bytes(b"no recording")
    assert run(["calibrate", "check", str(tmp_path / "other.mcap")]) == 2
    assert "not an MCAP recording" in capsys.readouterr().err
    (tmp_path / "cut.mcap").write_bytes(raw.read_bytes()[:8])
    assert run(["calibrate", "check", str(tmp_path / "cut.mcap")]) == 2
    assert "cut.mcap: no recording of a ground station" in capsys.readouterr().err


def test_a_marker_that_moves_judges_no_camera(tmp_path, capsys):
    files_for(tmp_path, LENS, np.full((720, 1280), 120, np.uint8), 1)
    carried = [drawn(CEILING, LENS, {1: (0.9, 0.6 + 0.1 * step, 0.0, 0.3)}) for step in range(3)]
    run_dir = str(recorded(tmp_path, carried))
    assert run(["calibrate", "check", run_dir, "--frames=3", "--marker=1=0.5,0.6"]) == 1
    out = capsys.readouterr().out
    assert "is unknown: ceiling: marker 1 moved" in out and "has marker" not in out
