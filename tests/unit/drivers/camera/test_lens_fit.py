"""A lens fitted to corners of known views: deviations that cover its errors, and views that show no focal length."""

import math

import cv2
import numpy as np
import pytest

from drivers.camera.calibration.lens_fit import LensFit, fit_lens
from drivers.camera.calibration.pattern import pattern_of
from drivers.camera.calibration.view_quality import KeptView
from groundstation.errors import DriverError
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.rotations import rotation_from_euler

SIZE = (1280, 720)
LENS = CameraIntrinsics(*SIZE, 900.0, 900.0, 640.0, 360.0, (-0.2, 0.05, 0.0, 0.0, 0.0))
PATTERN = pattern_of("9x6", 25.0)
POINTS = PATTERN.points - PATTERN.points.mean(axis=0)


def views(tilt_deg: float, seed: int = 1, count: int = 12, noise_px: float = 0.05) -> list[KeptView]:
    """Return views all over the picture, near and far, with leans of at most `tilt_deg` about each axis."""
    rng = np.random.default_rng(seed)
    kept: list[KeptView] = []
    while len(kept) < count:
        roll, pitch = np.radians(rng.uniform(-tilt_deg, tilt_deg, 2))
        x, y, z = rng.uniform((-0.5, -0.25, 0.35), (0.5, 0.25, 0.7))
        shift = np.array([x * z, y * z, z])
        pixels = LENS.project(POINTS @ rotation_from_euler(roll, pitch, rng.uniform(-0.3, 0.3)).T + shift)
        if LENS.contains(pixels, 10.0).all():
            kept.append(KeptView(str(len(kept)), pixels + rng.normal(0.0, noise_px, pixels.shape)))
    return kept


def fitted(tilt_deg: float, **options: float) -> LensFit:
    return fit_lens(views(tilt_deg, **options), PATTERN, SIZE)  # type: ignore[arg-type]


@pytest.mark.parametrize(("tilt_deg", "share"), [(0.0, "wholly"), (2.0, "by [3-9]%")])
def test_views_of_a_board_that_is_hardly_tilted_are_refused_with_a_remedy(tilt_deg: float, share: str) -> None:
    """They fit a focal length that is off by 8 % as well as the right one, with a residual of 0.05 px."""
    with pytest.raises(DriverError, match=f"focal length {share}.* uncertain .*: tilt the board by 20 to 40 degrees"):
        fitted(tilt_deg)


def test_the_deviations_cover_the_errors_also_of_little_tilted_views() -> None:
    fits = [fitted(5.0, seed=seed) for seed in range(2, 14)]
    ratios = [(fit.lens.fx_px - LENS.fx_px) / fit.std["fx_px"] for fit in fits]
    assert 0.5 < math.sqrt(np.mean(np.square(ratios))) < 1.7
    assert all(4.0 < fit.std["fx_px"] < 18.0 for fit in fits)


def test_of_well_tilted_views_they_are_those_of_opencv() -> None:
    kept = views(30.0)
    objects = [PATTERN.points.astype(np.float32)] * len(kept)
    corners = [view.corners.astype(np.float32).reshape(-1, 1, 2) for view in kept]
    for square, flags in ((False, 0), (True, cv2.CALIB_FIX_ASPECT_RATIO)):
        stated = cv2.calibrateCameraExtended(objects, corners, SIZE, np.eye(3), np.zeros(5), flags=flags)[5].ravel()[:9]
        fit = fit_lens(kept, PATTERN, SIZE, square_pixels=square)
        ours = np.array(list(fit.std.values()))
        assert ours[1:] == pytest.approx(stated[1:], rel=0.1)
        assert (ours[0] == ours[1]) == square


def test_views_through_a_fisheye_are_refused_with_the_likely_causes() -> None:
    """Equidistant, 170 degrees wide: a plumb-bob lens fits it to some pixels, which puts boards anywhere."""
    rng, kept = np.random.default_rng(3), list[KeptView]()
    while len(kept) < 24:
        roll, pitch, yaw = np.radians(rng.uniform(-30.0, 30.0, 3))
        aside, around = math.radians(rng.uniform(0.0, 70.0)), rng.uniform(-math.pi, math.pi)
        away = (math.sin(aside) * math.cos(around), math.sin(aside) * math.sin(around), math.cos(aside))
        points = POINTS @ rotation_from_euler(roll, pitch, yaw).T + rng.uniform(0.08, 0.2) * np.array(away)
        across = np.hypot(points[:, 0], points[:, 1])
        angle = np.arctan2(across, points[:, 2])
        pixels = np.array(SIZE) / 2 + 430.0 * (angle / across)[:, None] * points[:, :2]
        if angle.max() < math.radians(85.0) and LENS.contains(pixels, 10.0).all():
            kept.append(KeptView(str(len(kept)), pixels))
    with pytest.raises(DriverError, match=r"misses the corners by \d+\.\d px .*fisheye.*not flat.*rolling shutter"):
        fit_lens(kept, PATTERN, SIZE)
    assert fit_lens(kept, PATTERN, SIZE, keep_all=True).lens.residual_px > 1.5
