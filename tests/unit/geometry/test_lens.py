"""The lens model: known values, inversion everywhere in the picture, derivatives, refusal of nonsense."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.camera import settings as section
from groundstation.field.room import LensCalibration
from groundstation.geometry.lens import CameraIntrinsics, intrinsics_of
from groundstation.settings import room

PLAIN = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5)
FRONT = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5, (-0.30, 0.08, 0.0, 0.0, 0.0))
# The shipped calibration of the real front camera, and one with every coefficient in use.
STRONG = CameraIntrinsics(640, 360, 569.9, 568.5, 331.4, 135.2, (-0.527, 0.274, 0.0004, 0.0002, 0.0))
MIXED = CameraIntrinsics(640, 480, 536.0, 530.0, 342.0, 235.0, (-0.266, -0.0386, 0.0018, -0.0003, 0.238))


def test_a_point_on_the_axis_is_at_the_principal_point():
    assert FRONT.project(np.array([0.0, 0.0, 2.0])) == pytest.approx([319.5, 179.5])


def test_right_and_down_are_positive():
    u, v = PLAIN.project(np.array([0.5, 0.25, 2.0]))
    assert (u, v) == pytest.approx((319.5 + 115.0, 179.5 + 57.5))


def test_distortion_by_hand():
    # x = 0.5, y = 0, r2 = 0.25: 0.5 * (1 - 0.3 * 0.25 + 0.08 * 0.0625) = 0.465
    assert FRONT.project(np.array([1.0, 0.0, 2.0]))[0] == pytest.approx(319.5 + 460.0 * 0.465)


def test_tangential_distortion_by_hand():
    lens = CameraIntrinsics(640, 480, 100.0, 100.0, 0.0, 0.0, (0.0, 0.0, 0.01, 0.02, 0.0))
    # x = 0.2, y = 0.1, r2 = 0.05: dx = 2*.01*.02 + .02*(.05+.08), dy = .01*(.05+.02) + 2*.02*.02
    assert lens.project(np.array([0.2, 0.1, 1.0])) == pytest.approx([20.0 + 0.30, 10.0 + 0.15])


@pytest.mark.parametrize("lens", [PLAIN, FRONT, STRONG, MIXED])
def test_every_pixel_comes_back(lens):
    grid = np.stack(np.meshgrid(np.linspace(0, lens.width_px - 1, 23), np.linspace(0, lens.height_px - 1, 17)), -1)
    rays = lens.normalised_from_pixels(grid)
    reached = np.isfinite(rays).all(axis=-1)
    assert reached.mean() > 0.9
    assert np.abs(lens.pixels_from_normalised(rays) - grid)[reached].max() < 1e-8


def test_points_behind_the_camera_have_no_pixel():
    assert np.isnan(FRONT.project(np.array([[0.1, 0.1, -1.0], [0.0, 0.0, 0.0]]))).all()


def test_rays_beyond_the_fold_have_no_pixel():
    folding = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5, (-0.5, 0.0, 0.0, 0.0, 0.0))
    assert folding.max_radius == pytest.approx(math.sqrt(1 / 1.5), abs=0.01)
    assert np.isnan(folding.project(np.array([1.5, 0.0, 1.0]))).all()


@pytest.mark.parametrize("lens", [FRONT, STRONG, MIXED])
def test_jacobian_matches_differences(lens):
    points = np.array([[0.3, -0.2, 1.5], [-0.6, 0.3, 2.0], [0.05, 0.1, 0.7]])
    step = 1e-6
    columns = [(lens.project(points + d) - lens.project(points - d)) / (2 * step) for d in np.eye(3) * step]
    assert lens.project_jacobian(points) == pytest.approx(np.stack(columns, axis=-1), rel=1e-5, abs=1e-4)


@pytest.mark.parametrize(
    "wrong",
    [
        {"width_px": 0},
        {"fx_px": 0.0},
        {"cx_px": math.nan},
        {"distortion": (0.0, 0.0)},
        {"distortion": (math.inf, 0.0, 0.0, 0.0, 0.0)},
    ],
)
def test_impossible_calibrations_are_refused(wrong):
    good = {"width_px": 640, "height_px": 360, "fx_px": 460.0, "fy_px": 460.0, "cx_px": 319.5, "cy_px": 179.5}
    with pytest.raises(ValueError, match=r"camera|calibration"):
        CameraIntrinsics(**{**good, **wrong})


@pytest.mark.parametrize("kind", [room.CalibrationSettings, section.CalibrationSettings, LensCalibration])
def test_every_form_of_a_calibration_is_the_same_lens(kind):
    figures = {name: getattr(MIXED, name) for name in ("width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px")}
    calibration = kind(model="plumb_bob", distortion=MIXED.distortion, residual_px=0.3, **figures)
    assert intrinsics_of(calibration) == replace(MIXED, residual_px=0.3)


@pytest.mark.parametrize("lens", [PLAIN, FRONT, STRONG, MIXED])
def test_one_point_has_the_pixel_that_many_have(lens: CameraIntrinsics):
    points = np.random.default_rng(1).normal(size=(200, 3)) * (0.6, 0.4, 1.0)
    for point, pixel in zip(points.tolist(), lens.project(points).tolist(), strict=True):
        assert lens.pixel(*point) == (None if math.isnan(pixel[0]) else tuple(pixel))
