"""Pinhole camera with plumb-bob distortion (k1 k2 p1 p2 k3): points to pixels, pixels to rays, and derivatives.

Pixel (0, 0) is the centre of the top left pixel, as in OpenCV. Normalised coordinates are x / z, y / z.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from groundstation.arrays import Array

Scalars = TypeVar("Scalars", float, Array)

# Newton converges quadratically from the distorted point; 12 steps are ample even for k1 = -0.5 at the corners.
_NEWTON_STEPS = 12
# The remaining error is of the order of the last step's square.
_NEWTON_TOLERANCE = 1e-8
_MAX_RADIUS = 4.0
MOST_RESIDUAL_PX = 0.5
"""A lens that misses the corners of its own calibration by more errs in distances: by 2 % for each pixel."""
MOST_FOCAL_STD = 0.02
"""Deviation of a focal length, as a share, beyond which a calibration is of no use: distances err by as much."""


@dataclass(frozen=True, slots=True)
class CameraIntrinsics:
    """Calibration of one camera: picture size, focal lengths, principal point [px], distortion (k1 k2 p1 p2 k3).

    residual_px: rms reprojection error of the calibration. Raises ValueError for figures no camera has.
    """

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    residual_px: float = 0.2

    def __post_init__(self) -> None:
        if self.width_px < 1 or self.height_px < 1 or len(self.distortion) != 5:
            raise ValueError("a camera needs a positive picture size and five distortion coefficients")
        figures = (self.fx_px, self.fy_px, self.cx_px, self.cy_px, *self.distortion, self.residual_px)
        if not all(math.isfinite(figure) for figure in figures) or min(self.fx_px, self.fy_px) <= 0.0:
            raise ValueError("calibration figures must be finite and focal lengths positive")

    @property
    def matrix(self) -> Array:
        """Return the camera matrix K (3, 3)."""
        return np.array([[self.fx_px, 0.0, self.cx_px], [0.0, self.fy_px, self.cy_px], [0.0, 0.0, 1.0]])

    @property
    def max_radius(self) -> float:
        """Return the undistorted radius up to which the distorted radius grows, so that distortion can be inverted."""
        return _fold_radius(self.distortion)

    def project(self, points: Array) -> Array:
        """Return pixels (..., 2) of points (..., 3) [camera_optical].

        NaN behind the camera and beyond the lens model.
        """
        points = np.asarray(points, dtype=np.float64)
        depth = points[..., 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            normalised = np.where((depth > 1e-9)[..., None], points[..., :2] / depth[..., None], np.nan)
        return self.pixels_from_normalised(normalised)

    def pixel(self, x: float, y: float, z: float) -> tuple[float, float] | None:
        """Return the pixel of one point [camera_optical] as `project` does, ten times as fast; None instead of NaN."""
        if not z > 1e-9:
            return None
        x, y = x / z, y / z
        if not x * x + y * y <= self.max_radius**2:
            return None
        x, y = _distort(x, y, self.distortion)
        return self.fx_px * x + self.cx_px, self.fy_px * y + self.cy_px

    def pixels_from_normalised(self, normalised: Array) -> Array:
        """Return pixels (..., 2) of undistorted normalised coordinates (..., 2); NaN where the lens model folds."""
        x, y = normalised[..., 0], normalised[..., 1]
        with np.errstate(invalid="ignore"):
            inside = x * x + y * y <= self.max_radius**2
        x_d, y_d = _distort(x, y, self.distortion)
        pixels = np.empty(normalised.shape)
        pixels[..., 0], pixels[..., 1] = self.fx_px * x_d + self.cx_px, self.fy_px * y_d + self.cy_px
        return pixels if inside.all() else np.where(inside[..., None], pixels, np.nan)

    def normalised_from_pixels(self, pixels: Array) -> Array:
        """Return undistorted normalised coordinates (..., 2) of pixels (..., 2), by Newton's method.

        Pixels that no ray of the lens model reaches come back as NaN.
        """
        pixels = np.asarray(pixels, dtype=np.float64)
        x_d = (pixels[..., 0] - self.cx_px) / self.fx_px
        y_d = (pixels[..., 1] - self.cy_px) / self.fy_px
        x, y = _undistort(x_d, y_d, self.distortion)
        with np.errstate(invalid="ignore"):
            inside = x * x + y * y <= self.max_radius**2
        return np.where(inside[..., None], np.stack((x, y), axis=-1), np.nan)

    def project_jacobian(self, points: Array) -> Array:
        """Return d(pixel) / d(point) (..., 2, 3) for points (..., 3) [px/m; camera_optical]."""
        points = np.asarray(points, dtype=np.float64)
        z = points[..., 2]
        x, y = points[..., 0] / z, points[..., 1] / z
        xx, xy, yy = _distort_slopes(x, y, self.distortion)
        # Times the pinhole's own: (1, 0, -x) / z and (0, 1, -y) / z.
        by_x, by_y = self.fx_px / z, self.fy_px / z
        jacobian = np.empty((*points.shape[:-1], 2, 3))
        jacobian[..., 0, 0], jacobian[..., 0, 1], jacobian[..., 0, 2] = by_x * xx, by_x * xy, -by_x * (xx * x + xy * y)
        jacobian[..., 1, 0], jacobian[..., 1, 1], jacobian[..., 1, 2] = by_y * xy, by_y * yy, -by_y * (xy * x + yy * y)
        return jacobian

    def contains(self, pixels: Array, margin_px: float = 0.0) -> NDArray[np.bool_]:
        """Return which pixels (..., 2) lie in the picture, at least `margin_px` from its border."""
        u, v = pixels[..., 0], pixels[..., 1]
        with np.errstate(invalid="ignore"):
            return np.asarray(
                (u >= margin_px - 0.5)
                & (v >= margin_px - 0.5)
                & (u <= self.width_px - 0.5 - margin_px)
                & (v <= self.height_px - 0.5 - margin_px)
            )


@cache
def _fold_radius(distortion: tuple[float, ...]) -> float:
    k1, k2, _, _, k3 = distortion
    radius = np.linspace(0.0, _MAX_RADIUS, 801)
    slope = 1.0 + radius**2 * (3 * k1 + radius**2 * (5 * k2 + radius**2 * 7 * k3))
    folds = np.flatnonzero(slope <= 1e-3)
    return float(radius[folds[0]]) if folds.size else _MAX_RADIUS


def _distort(x: Scalars, y: Scalars, distortion: tuple[float, ...]) -> tuple[Scalars, Scalars]:
    k1, k2, p1, p2, k3 = distortion
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return (
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    )


def _distort_slopes(x: Array, y: Array, distortion: tuple[float, ...]) -> tuple[Array, Array, Array]:
    """Return d(distorted) / d(undistorted): its elements xx, xy = yx, yy."""
    k1, k2, p1, p2, k3 = distortion
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3)
    xx = radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
    xy = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
    yy = radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
    return xx, xy, yy


def _undistort(x_d: Array, y_d: Array, distortion: tuple[float, ...]) -> tuple[Array, Array]:
    # OpenCV 5 stops after five fixed-point steps, which is pixels off at the corners of a wide lens.
    x, y = x_d.copy(), y_d.copy()
    if not any(distortion):
        return x, y
    for _ in range(_NEWTON_STEPS):
        x_now, y_now = _distort(x, y, distortion)
        error_x, error_y = x_now - x_d, y_now - y_d
        a, b, d = _distort_slopes(x, y, distortion)
        determinant = a * d - b * b
        determinant = np.where(np.abs(determinant) < 1e-6, 1e-6, determinant)
        step_x, step_y = (d * error_x - b * error_y) / determinant, (a * error_y - b * error_x) / determinant
        most_x, most_y = np.abs(step_x).max(initial=0.0), np.abs(step_y).max(initial=0.0)
        if not (most_x <= 0.5 and most_y <= 0.5):
            # A bounded step keeps pixels outside the lens model from running away.
            step_x, step_y = np.clip(step_x, -0.5, 0.5), np.clip(step_y, -0.5, 0.5)
        x, y = x - step_x, y - step_y
        if max(most_x, most_y) < _NEWTON_TOLERANCE:
            break
    x_now, y_now = _distort(x, y, distortion)
    bad = np.hypot(x_now - x_d, y_now - y_d) > 1e-9
    return np.where(bad, np.nan, x), np.where(bad, np.nan, y)


class LensFigures(Protocol):
    """A lens calibration in the form of settings, resolved field and camera driver's section."""

    @property
    def width_px(self) -> int:
        """Width of the picture."""

    @property
    def height_px(self) -> int:
        """Height of the picture."""

    @property
    def fx_px(self) -> float:
        """Focal length along the picture's x axis."""

    @property
    def fy_px(self) -> float:
        """Focal length along its y axis."""

    @property
    def cx_px(self) -> float:
        """Principal point, x."""

    @property
    def cy_px(self) -> float:
        """Principal point, y."""

    @property
    def distortion(self) -> tuple[float, float, float, float, float]:
        """k1, k2, p1, p2, k3."""

    @property
    def residual_px(self) -> float:
        """RMS residual of the calibration."""


def intrinsics_of(lens: LensFigures) -> CameraIntrinsics:
    """Return the lens model of a calibration; raises ValueError for figures no camera has."""
    return CameraIntrinsics(
        lens.width_px, lens.height_px, lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, lens.distortion,
        lens.residual_px,
    )  # fmt: skip
