"""Draws one board: every pixel of its window looks along its own ray, so corners are exact to hundredths of a pixel."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.geometry import board as marker
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from sim_bridge.render.lens_table import PAD, LensTable

Array = NDArray[np.float64]
Float32 = NDArray[np.float32]
Picture = NDArray[np.uint8]

_MIP_TEXELS = (64, 32, 16, 8, 4)
_OVERSAMPLING = 2
_WINDOW_MARGIN_PX = 4
_NEAREST_M = 0.12
# Measured: cornerSubPix then sees the demanded rms (cubic interpolation overshoots, its window averages).
_FIELD_GAIN = 1.03


@dataclass(frozen=True, slots=True)
class Flaws:
    """What keeps a board's picture from being ideal: corner error [px rms], defocus [px sigma], smear [px, (2)]."""

    corner_px: float = 0.0
    blur_px: float = 0.0
    smear_px: tuple[float, float] = (0.0, 0.0)


class BoardPainter:
    """The printed card of one marker at several resolutions, and how to lay it into a picture."""

    def __init__(self, code: int, square_mm: float, intrinsics: CameraIntrinsics, table: LensTable) -> None:
        self._board = marker.Board(code, square_mm)
        self._intrinsics = intrinsics
        self._table = table
        self._mips = [_with_coverage(*marker.raster(code, texels)) for texels in _MIP_TEXELS]
        x0, x1, y0, y1 = marker.EXTENT
        rim = [(x0 + (x1 - x0) * s, y) for s in (0, 0.5, 1) for y in (y0, y1)]
        rim += [(x, (y0 + y1) / 2) for x in (x0, x1)]
        self._rim = np.column_stack((np.array(rim), np.zeros(len(rim)))) * self._board.square_m

    def draw(self, picture: Picture, optical_from_marker: Pose, flaws: Flaws, random: np.random.Generator) -> None:
        """Lay the board into the picture; nothing happens when it is behind, beyond the border or turned away."""
        rim = optical_from_marker.apply(self._rim)
        faces_camera = float(optical_from_marker.rotation[:, 2] @ optical_from_marker.translation) < 0.0
        if rim[:, 2].min() < _NEAREST_M or not faces_camera:
            return
        window = self._window(self._intrinsics.project(rim))
        if window is None:
            return
        x, y = self._table.window(*window)
        spacing = self._spacing_px(optical_from_marker)
        if flaws.corner_px > 0.0:
            x, y = _warped(x, y, flaws.corner_px, spacing, random)
        patch = self._sample(x, y, optical_from_marker, spacing)
        _blend(picture, window, _smeared(patch, flaws))

    def _window(self, rim_px: Array) -> tuple[int, int, int, int] | None:
        rim_px = rim_px[np.isfinite(rim_px).all(axis=1)]
        if not len(rim_px):
            return None
        low = np.floor(rim_px.min(axis=0)).astype(int) - _WINDOW_MARGIN_PX
        high = np.ceil(rim_px.max(axis=0)).astype(int) + _WINDOW_MARGIN_PX + 1
        left, top = max(0, int(low[0])), max(0, int(low[1]))
        right, bottom = min(self._table.width, int(high[0])), min(self._table.height, int(high[1]))
        return (left, top, right, bottom) if right > left and bottom > top else None

    def _spacing_px(self, optical_from_marker: Pose) -> float:
        """Return the side of a square in the picture at the board's centre (geometric mean of its two directions)."""
        jacobian = self._intrinsics.project_jacobian(optical_from_marker.translation)
        sides = jacobian @ optical_from_marker.rotation[:, :2] * self._board.square_m
        return max(0.5, math.sqrt(abs(float(np.linalg.det(sides)))))

    def _sample(self, x: Float32, y: Float32, optical_from_marker: Pose, spacing: float) -> Float32:
        """Return the window's grey times coverage, and coverage (h, w, 2), for the widened window."""
        level = next((i for i, n in enumerate(_MIP_TEXELS) if n <= 1.3 * _OVERSAMPLING * spacing), len(_MIP_TEXELS) - 1)
        texture, texel_from_square = self._mips[level]
        square_from_marker = np.diag((1 / self._board.square_m, 1 / self._board.square_m, 1.0))
        r, t = optical_from_marker.rotation, optical_from_marker.translation
        optical_from_plane = np.column_stack((r[:, 0], r[:, 1], t))
        h = (texel_from_square @ square_from_marker @ np.linalg.inv(optical_from_plane)).astype(np.float32)
        scale = 1.0 / (h[2, 0] * x + h[2, 1] * y + h[2, 2])
        u = (h[0, 0] * x + h[0, 1] * y + h[0, 2]) * scale
        v = (h[1, 0] * x + h[1, 1] * y + h[1, 2]) * scale
        # Enlarging a smooth map by two gives the rays a quarter pixel to all four sides of each centre.
        size = (_OVERSAMPLING * x.shape[1], _OVERSAMPLING * x.shape[0])
        fine_u, fine_v = (cv2.resize(part, size, interpolation=cv2.INTER_LINEAR) for part in (u, v))
        fine = cv2.remap(texture, fine_u, fine_v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=(0, 0))
        return cv2.resize(fine, (x.shape[1], x.shape[0]), interpolation=cv2.INTER_AREA).astype(np.float32)


def _with_coverage(picture: Picture, texel_from_square: Array) -> tuple[Picture, Array]:
    return np.dstack((picture, np.full_like(picture, 255))), texel_from_square


def _warped(
    x: Float32, y: Float32, rms_px: float, spacing: float, random: np.random.Generator
) -> tuple[Float32, Float32]:
    """Return the rays seen through a smooth random displacement, independent from corner to corner."""
    rows, columns = x.shape
    nodes = (max(2, round(rows / spacing) + 1), max(2, round(columns / spacing) + 1))
    field = random.normal(0.0, rms_px * _FIELD_GAIN, (*nodes, 2)).astype(np.float32)
    shift = cv2.resize(field, (columns, rows), interpolation=cv2.INTER_CUBIC)
    across, down = shift[..., 0], shift[..., 1]
    centre_row, centre_column = rows // 2, columns // 2
    part = slice(centre_row - 1, centre_row + 2), slice(centre_column - 1, centre_column + 2)
    slopes = [(float(np.diff(a[part], axis=1).mean()), float(np.diff(a[part], axis=0).mean())) for a in (x, y)]
    return (
        x + np.float32(slopes[0][0]) * across + np.float32(slopes[0][1]) * down,
        y + np.float32(slopes[1][0]) * across + np.float32(slopes[1][1]) * down,
    )


def _smeared(patch: Float32, flaws: Flaws) -> Float32:
    if flaws.blur_px > 0.0:
        patch = np.asarray(cv2.GaussianBlur(patch, (0, 0), flaws.blur_px), dtype=np.float32)
    length = math.hypot(*flaws.smear_px)
    if length < 0.5:
        return patch
    steps = min(64, math.ceil(length) * 2 + 1)
    half = min(31, math.ceil(length / 2) + 1)
    kernel = np.zeros((2 * half + 1, 2 * half + 1), dtype=np.float32)
    for share in np.linspace(-0.5, 0.5, steps):
        # Splat each instant of the exposure onto its four nearest kernel cells.
        column, row = half + share * flaws.smear_px[0], half + share * flaws.smear_px[1]
        column, row = min(max(column, 0.0), 2 * half - 1e-6), min(max(row, 0.0), 2 * half - 1e-6)
        i, j = int(row), int(column)
        b, a = row - i, column - j
        kernel[i : i + 2, j : j + 2] += np.array([[(1 - a) * (1 - b), a * (1 - b)], [(1 - a) * b, a * b]]) / steps
    return np.asarray(cv2.filter2D(patch, -1, kernel), dtype=np.float32)


def _blend(picture: Picture, window: tuple[int, int, int, int], patch: Float32) -> None:
    left, top, right, bottom = window
    inner = patch[PAD : PAD + bottom - top, PAD : PAD + right - left]
    below = picture[top:bottom, left:right]
    coverage = inner[..., 1] * np.float32(1 / 255)
    below[...] = (below * (1.0 - coverage) + inner[..., 0] + np.float32(0.5)).astype(np.uint8)
