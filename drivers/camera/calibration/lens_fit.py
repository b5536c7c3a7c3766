"""Fits a lens to views of a board by least squares, without views that fit no lens, with each figure's deviation."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from drivers.camera.calibration.pattern import Pattern
from drivers.camera.calibration.view_quality import KeptView
from groundstation.arrays import Array
from groundstation.errors import DriverError
from groundstation.geometry.lens import MOST_FOCAL_STD, CameraIntrinsics

LEAST_VIEWS = 6
_ROUNDS = 4
_OUTLIER_RATIO, _OUTLIER_PX = 2.5, 0.3
# Through a worse lens the detector would refuse its boards (`DetectorSettings.max_residual_px`).
_USELESS_PX = 1.5
_TINY = 1e-12
_NAMES = ("fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3")


@dataclass(frozen=True, slots=True)
class LensFit:
    """A lens, one sigma of each of its nine figures, rms [px] by view, and the dropped views.

    dropped: views that fit no lens, with their rms; all_views_px: rms of a fit to all views, including those.
    """

    lens: CameraIntrinsics
    std: dict[str, float]
    by_view_px: dict[str, float]
    dropped: dict[str, float]
    all_views_px: float


def fit_lens(
    views: Sequence[KeptView],
    pattern: Pattern,
    size: tuple[int, int],
    keep_all: bool = False,
    square_pixels: bool = False,
) -> LensFit:
    """Return the lens of pictures of (width, height).

    keep_all: drop no view, and take a lens that fits badly. Raises DriverError when the views are too few, no lens fits
    them, or they hardly show its focal length.
    """
    dropped: dict[str, float] = {}
    kept, all_views_px = list(views), 0.0
    for turn in range(_ROUNDS):
        if len(kept) < LEAST_VIEWS:
            raise DriverError(f"{len(kept)} usable views are too few, {LEAST_VIEWS} is the least: show the board more")
        rms, matrix, distortion, std, errors = _fitted(kept, pattern, size, square_pixels)
        all_views_px = all_views_px or rms
        bad = [] if keep_all or turn == _ROUNDS - 1 else _outliers(errors)
        if not bad:
            break
        dropped |= {kept[index].name: float(errors[index]) for index in bad}
        kept = [view for index, view in enumerate(kept) if index not in bad]
    uncertain = max(std[0] / matrix[0, 0], std[1] / matrix[1, 1])
    if not uncertain <= MOST_FOCAL_STD:
        raise DriverError(_too_frontal(uncertain))
    if rms > _USELESS_PX and not keep_all:
        raise DriverError(_unfit(rms))
    k1, k2, p1, p2, k3 = distortion.tolist()
    try:
        lens = CameraIntrinsics(
            *size, matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], (k1, k2, p1, p2, k3), rms
        )
    except ValueError as error:
        raise DriverError(f"no lens comes of these views ({error}): are they really views of one flat board?") from None
    by_view = {view.name: float(error) for view, error in zip(kept, errors, strict=True)}
    return LensFit(lens, dict(zip(_NAMES, std.tolist(), strict=True)), by_view, dropped, all_views_px)


def _fitted(
    views: list[KeptView], pattern: Pattern, size: tuple[int, int], square_pixels: bool
) -> tuple[float, Array, Array, Array, Array]:
    """Return rms, camera matrix, distortion (5), standard deviations (9) and rms by view."""
    objects = [pattern.points.astype(np.float32)] * len(views)
    corners = [view.corners.astype(np.float32).reshape(-1, 1, 2) for view in views]
    flags = cv2.CALIB_FIX_ASPECT_RATIO if square_pixels else 0
    try:
        rms, matrix, distortion, turns, shifts, _, _, errors = cv2.calibrateCameraExtended(
            objects, corners, size, np.eye(3), np.zeros(5), flags=flags
        )
        lens = np.asarray(matrix, dtype=np.float64), np.asarray(distortion, dtype=np.float64).ravel()[:5]
        poses = zip(np.asarray(turns, np.float64), np.asarray(shifts, np.float64), strict=True)
        slopes = [_slopes(pattern.points, turn, shift, *lens) for turn, shift in poses]
        squared_error = rms**2 * sum(len(view.corners) for view in views)
        figures = _deviations(slopes, squared_error, square_pixels)
    except (cv2.error, np.linalg.LinAlgError):
        raise DriverError("no lens comes of these views: show the board from more directions, tilted") from None
    return float(rms), *lens, figures, np.asarray(errors, dtype=np.float64).ravel()


def _slopes(points: Array, turn: Array, shift: Array, matrix: Array, distortion: Array) -> Array:
    """Return how a view's pixels change with the lens's nine figures (2n, 9), as far as no pose of the board does."""
    by_all = np.asarray(cv2.projectPoints(points, turn, shift, matrix, distortion)[1], dtype=np.float64)
    by_pose, by_lens = by_all[:, :6], by_all[:, 6 : 6 + len(_NAMES)]
    basis = np.linalg.qr(by_pose / np.linalg.norm(by_pose, axis=0))[0]
    return np.asarray(by_lens - basis @ (basis.T @ by_lens))


def _deviations(slopes: list[Array], squared_error: float, square_pixels: bool) -> Array:
    """Return one sigma (9) of the lens's figures; huge where the views do not show one.

    OpenCV's own leave out the directions that the views show least: those of boards that are hardly tilted.
    """
    by_lens = np.concatenate(slopes)
    if square_pixels:  # one focal length was fitted
        by_lens = np.column_stack((by_lens[:, 0] + by_lens[:, 1], by_lens[:, 2:]))
    variance = squared_error / (len(by_lens) - by_lens.shape[1] - 6 * len(slopes))
    scale = np.maximum(np.linalg.norm(by_lens, axis=0), _TINY)
    _, strengths, directions = np.linalg.svd(by_lens / scale, full_matrices=False)
    spread = directions / np.maximum(strengths, _TINY)[:, None]
    std = np.sqrt(variance * (spread**2).sum(axis=0)) / scale
    return np.insert(std, 0, std[0]) if square_pixels else std


def _too_frontal(uncertain: float) -> str:
    known = f"by {uncertain:.0%}" if uncertain < 1.0 else "wholly"
    return (
        f"these views leave the focal length {known} uncertain (at most {MOST_FOCAL_STD:.0%}): "
        "tilt the board by 20 to 40 degrees in several directions"
    )


def _unfit(rms: float) -> str:
    return (
        f"the best lens misses the corners by {rms:.1f} px (at most {_USELESS_PX:g}): a fisheye lens, which this model "
        "is none of? Else a board that is not flat, or that moved before a rolling shutter, or pictures of several "
        "cameras"
    )


def _outliers(errors: Array) -> list[int]:
    median = float(np.median(errors))
    return np.flatnonzero((errors > _OUTLIER_RATIO * median) & (errors > _OUTLIER_PX)).tolist()
