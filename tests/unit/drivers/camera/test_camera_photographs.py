"""Corners in real photographs (OpenCV's calibration pictures): found, and accurate to the print's own error."""

import cv2
import numpy as np
import pytest

from drivers.camera.calibration.pattern import Pattern
from drivers.camera.detect import spacing_px
from drivers.camera.search import saddle_points, search
from groundstation.geometry.lens import CameraIntrinsics

LENS = CameraIntrinsics(
    640,
    480,
    535.91573396163199,
    535.91573396163199,
    342.28315473308373,
    235.57082909788173,
    (-0.26637260909660682, -0.038588898922304653, 0.0017831947042852964, -0.00028122100441115472, 0.23839153080878486),
)


@pytest.fixture
def photographs(real_data):
    return sorted(real_data("camera_calibration").glob("*.jpg"))


def read_grey(path):
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert picture is not None, path
    return picture


def found_corners(picture):
    return Pattern(9, 6, 25.0).corners(picture)


def test_all_boards_are_found_and_refined_to_a_fifth_of_a_pixel(photographs):
    """13 of 13; the residual is that of a calibration from these corners, its lens model included."""
    pictures = [read_grey(path) for path in photographs]
    corners = [found_corners(picture) for picture in pictures]
    assert len(corners) == 13
    assert all(found is not None for found in corners)
    plane = np.array([[x, y, 0.0] for y in range(6) for x in range(9)], dtype=np.float32)
    image = [np.asarray(found, dtype=np.float32).reshape(-1, 1, 2) for found in corners]
    residual, matrix, *_ = cv2.calibrateCamera([plane] * 13, image, (640, 480), None, None)
    assert residual <= 0.2
    # The published focal length comes from corners of a coarser finder, whose residual is 0.39 px.
    assert matrix[0, 0] == pytest.approx(535.9, rel=0.01)


def test_a_picture_without_a_board_has_no_corners():
    floor = np.random.default_rng(0).integers(60, 180, (480, 640)).astype(np.uint8)
    assert found_corners(floor) is None


@pytest.mark.parametrize("name", ["left01.jpg", "left03.jpg", "left05.jpg", "left12.jpg"])
def test_our_lens_explains_real_corners(name, real_data):
    """A flat board through the published calibration: a homography of undistorted corners leaves little residual."""
    corners = found_corners(read_grey(real_data("camera_calibration") / name))
    rays = LENS.normalised_from_pixels(corners)
    plane = np.array([[x, y] for y in range(6) for x in range(9)], dtype=np.float64)
    h, _ = cv2.findHomography(plane, rays)
    lifted = np.column_stack((plane, np.ones(len(plane)))) @ h.T
    errors = LENS.pixels_from_normalised(lifted[:, :2] / lifted[:, 2:]) - corners
    assert np.sqrt((errors**2).sum(axis=1).mean()) < 0.35


def test_nearly_all_real_corners_are_seeds_of_the_search(photographs):
    shares = []
    for path in photographs:
        picture = read_grey(path)
        seeds = saddle_points(picture).points
        corners = found_corners(picture)
        near = np.linalg.norm(corners[:, None] - seeds[None], axis=-1).min(axis=1)
        shares.append(float((near < 0.3 * np.linalg.norm(corners[1] - corners[0])).mean()))
    assert len(shares) == 13
    assert np.mean(shares) > 0.95


def test_a_larger_board_is_not_taken_for_a_marker(photographs):
    assert len(photographs) == 13
    for path in photographs:
        picture = read_grey(path)
        assert [spacing_px(find.corners) for find in search(picture, [])] == []
