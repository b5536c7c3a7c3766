"""Lens calibration from pictures: published calibration of real photographs, drawn boards, and bad input."""

from functools import cache

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from ruamel.yaml import YAML

from drivers.camera.calibration.coverage import TILTS, coverage_of
from drivers.camera.calibration.pattern import pattern_of
from drivers.camera.calibration.view_quality import Flaw, Judge
from groundstation.cli.main import run
from groundstation.geometry.lens import CameraIntrinsics, intrinsics_of
from groundstation.geometry.rotations import rotation_from_euler
from groundstation.settings.calibration_file import load_calibration

LENS = CameraIntrinsics(480, 360, 400.0, 402.0, 243.0, 176.0, (-0.2, 0.05, 0.001, -0.001, 0.0))
PATTERN = pattern_of("9x6", 25.0)
POSES = [
    (roll, pitch, yaw, x, y, z)
    for z in (0.3, 0.55)
    for roll, pitch, yaw, x, y in [
        (0.0, 0.0, 0.0, 0.0, 0.0),
        (0.5, 0.0, 0.1, -0.06, -0.04),
        (-0.5, 0.0, -0.1, 0.06, 0.04),
        (0.0, 0.5, 0.05, -0.06, 0.04),
        (0.1, -0.5, 0.0, 0.06, -0.04),
    ]
]


@cache
def rays_of_pixels():
    v, u = np.mgrid[0 : LENS.height_px * 2, 0 : LENS.width_px * 2]
    pixels = np.stack((u, v), axis=-1).reshape(-1, 2) / 2.0 - 0.25
    return np.column_stack((LENS.normalised_from_pixels(pixels), np.ones(len(pixels))))


def drawn(pose):
    """Return a picture of the 9x6 board: pixel rays intersected with the board's plane, four to a pixel."""
    roll, pitch, yaw, x, y, z = pose
    turn, shift = rotation_from_euler(roll, pitch, yaw), np.array([x, y, z])
    rays, at = rays_of_pixels(), turn.T @ shift
    board = rays @ turn
    place = board * (at[2] / board[:, 2])[:, None] - at
    squares = np.floor(place[:, :2] / 0.025 + (5.0, 3.5)).astype(int)
    inside = (squares >= 0).all(axis=1) & (squares[:, 0] < 10) & (squares[:, 1] < 7)
    dark = inside & (squares.sum(axis=1) % 2 == 0)
    grey = np.where(dark, 30.0, 220.0).reshape(LENS.height_px, 2, LENS.width_px, 2).mean(axis=(1, 3))
    return cv2.GaussianBlur(grey.astype(np.uint8), (0, 0), 0.6)


def folder_of(path, pictures):
    path.mkdir()
    for number, picture in enumerate(pictures):
        cv2.imwrite(str(path / f"{number:02d}.png"), picture)
    return path


@pytest.fixture(scope="module")
def board_pictures():
    return [drawn(pose) for pose in POSES]


@pytest.fixture
def calibrated(tmp_path, capsys):
    """Run `calibrate camera`; return exit code, output, and the written file."""

    def call(source, *options):
        file = tmp_path / "out" / "lens.yaml"
        code = run(["calibrate", "camera", str(source), "--output", str(file), *options])
        said = capsys.readouterr()
        return code, said.out + said.err, YAML(typ="safe").load(file.read_text()) if file.exists() else None

    return call


def test_the_published_calibration_is_reproduced_with_its_recipe(calibrated, real_data):
    folder = real_data("camera_calibration")
    code, _, file = calibrated(folder, "--recipe", "opencv")
    published = cv2.FileStorage(str(folder / "left_intrinsics.yml"), cv2.FILE_STORAGE_READ)
    focal_px = published.getNode("camera_matrix").mat()[0, 0]
    rms_px = published.getNode("avg_reprojection_error").real()
    assert code == 0 and file["views"] == 13
    assert file["fx_px"] == pytest.approx(focal_px, rel=0.005)
    assert file["fy_px"] == pytest.approx(focal_px, rel=0.005)
    assert file["residual_px"] == pytest.approx(rms_px, abs=0.02)


def test_our_own_recipe_fits_the_photographs_better_than_the_published_lens(calibrated, real_data):
    """The published figures use corners that shifted in a window of 23 px (1.2 px in left02)."""
    folder = real_data("camera_calibration")
    code, _, file = calibrated(folder)
    assert code == 0 and file["views"] == 13
    assert file["residual_px"] <= 0.2
    assert file["fx_px"] == pytest.approx(535.916, rel=0.007)
    published = CameraIntrinsics(
        640, 480, 535.91573, 535.91573, 342.28315, 235.57083, (-0.266373, -0.0385889, 0.00178319, -0.00028122, 0.238392)
    )
    errors = []
    for path in sorted(folder.glob("left*.jpg")):
        picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        assert picture is not None, path
        corners = PATTERN.corners(np.asarray(picture, np.uint8))
        assert corners is not None
        camera = (published.matrix, np.array(published.distortion))
        _, turn, shift = cv2.solvePnP(PATTERN.points, corners.reshape(-1, 1, 2), *camera)
        seen = cv2.projectPoints(PATTERN.points, turn, shift, *camera)[0].reshape(-1, 2)
        errors.append(((seen - corners) ** 2).sum(axis=1).mean())
    # Both lenses explain the same corners, ours a little better.
    assert 0.0 <= np.sqrt(np.mean(errors)) - file["residual_px"] < 0.02


def test_a_known_lens_is_found_again_within_its_own_deviation(tmp_path, calibrated, board_pictures):
    code, said, file = calibrated(folder_of(tmp_path / "in", board_pictures), "--judged")
    assert code == 0, said
    for name in ("fx_px", "fy_px", "cx_px", "cy_px"):
        assert abs(file[name] - getattr(LENS, name)) < 0.5 + 4.0 * file["std"][name], name
    assert file["residual_px"] < 0.2 and file["views"] == len(POSES)
    assert intrinsics_of(load_calibration(tmp_path / "out" / "lens.yaml")).width_px == 480
    assert len(list((tmp_path / "out" / "lens-judged").iterdir())) == len(POSES)


def wavy(picture, phase):
    """Return a picture as of a board that is bent, in each view another way."""
    v, u = np.mgrid[0 : LENS.height_px, 0 : LENS.width_px].astype(np.float32)
    return cv2.remap(picture, u + 1.2 * np.sin(v / 20.0 + phase).astype(np.float32), v, cv2.INTER_LINEAR)


def test_a_lens_that_fits_badly_is_written_with_a_warning(tmp_path, calibrated, board_pictures):
    bent = [wavy(picture, number) for number, picture in enumerate(board_pictures)]
    code, said, written = calibrated(folder_of(tmp_path / "bent", bent))
    assert code == 0 and 0.5 < written["residual_px"] < 1.5
    assert "fits badly" in said and "is the board flat" in said
    code, said, _ = calibrated(folder_of(tmp_path / "flat", board_pictures), "--force")
    assert code == 0 and "fits badly" not in said


def test_a_view_that_fits_no_lens_is_dropped_by_name(tmp_path, calibrated, board_pictures):
    bent = board_pictures[1].copy()
    columns, rows = np.meshgrid(np.arange(480, dtype=np.float32), np.arange(360, dtype=np.float32))
    bent = cv2.remap(
        board_pictures[1], columns + 4 * np.sin(rows / 25), rows + 4 * np.sin(columns / 25), cv2.INTER_LINEAR
    )
    code, said, file = calibrated(folder_of(tmp_path / "in", [*board_pictures[2:], np.roll(bent, 14, axis=1)]))
    assert code == 0 and file["views"] == len(POSES) - 2, said
    assert "dropped, they fit no lens: 08.png" in said


def test_flaws_are_named(board_pictures):
    picture = board_pictures[5]
    judge = Judge(PATTERN, (480, 360))
    assert judge.look("first", picture)[0] is None
    assert judge.look("again", np.roll(picture, 2, axis=1))[0] is Flaw.SIMILAR
    assert judge.look("blurred", cv2.GaussianBlur(board_pictures[0], (0, 0), 3.5))[0] is Flaw.BLURRED
    assert judge.look("empty", np.full((360, 480), 128, np.uint8))[0] is Flaw.NO_BOARD
    assert judge.look("cut", np.roll(board_pictures[0], -150, axis=1))[0] in (Flaw.CUT, Flaw.COUNT)
    assert judge.look("far", drawn((0.0, 0.0, 0.0, 0.0, 0.0, 1.4)))[0] in (Flaw.SMALL, Flaw.NO_BOARD)
    assert len(judge.views) == 1


def test_coverage_names_what_is_missing(board_pictures):
    judge = Judge(PATTERN, (480, 360))
    for number, picture in enumerate(board_pictures):
        judge.look(str(number), picture)
    assert coverage_of(judge.views, PATTERN, (480, 360)).missing_tilts == ()
    first = coverage_of(judge.views[:1], PATTERN, (480, 360))
    assert first.missing_tilts == TILTS
    assert "far (board as wide as a quarter of the picture)" in first.missing
    leaning = coverage_of([v for v in judge.views if v.name == "3"], PATTERN, (480, 360))
    # Turned about y by a positive angle, the right side goes away from the camera.
    assert "right side nearer" not in leaning.missing_tilts and "left side nearer" in leaning.missing_tilts


def test_bad_input_is_named_with_what_to_do(tmp_path, calibrated, board_pictures):
    folder = folder_of(tmp_path / "in", board_pictures)
    code, said, _ = calibrated(folder, "--board", "10x7")
    assert code == 2 and "--board 9x6?" in said
    code, said, file = calibrated(folder_of(tmp_path / "few", board_pictures[:3]))
    assert code == 2 and "3 usable view(s), at least 6 are needed" in said and file is None
    code, said, _ = calibrated(folder, "--board", "nine")
    assert code == 2 and "inner corners" in said
    code, said, _ = calibrated(tmp_path / "nowhere")
    assert code == 2 and "no file or folder" in said
    mixed = folder_of(tmp_path / "mixed", [board_pictures[0], board_pictures[1][:300]])
    code, said, _ = calibrated(mixed)
    assert code == 2 and "01.png is 480x300, those before were 480x360" in said
    code, said, _ = calibrated(folder_of(tmp_path / "none", []))
    assert code == 4 and "no picture in it" in said
    (tmp_path / "out" / "lens.yaml").write_text("mine")
    assert run(["calibrate", "camera", str(folder), "--output", str(tmp_path / "out" / "lens.yaml")]) == 2
    assert (tmp_path / "out" / "lens.yaml").read_text() == "mine"


def test_a_dead_stream_is_told_after_some_patience(calibrated, monkeypatch):
    monkeypatch.setattr("drivers.camera.calibration.feed.PATIENCE_S", 0.5)
    code, said, _ = calibrated("http://127.0.0.1:9/video.mjpg")
    assert code == 4 and "no picture for" in said and "127.0.0.1:9" in said


def test_help_shows_how():
    from groundstation.cli.main import groundstation

    assert "--board" in CliRunner().invoke(groundstation, ["calibrate", "camera", "--help"]).output
