"""Draws one board with a ray for each pixel of its window, so corners are exact to hundredths of a pixel."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.arrays import Array, Image
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from sim_bridge.render.card import Card
from sim_bridge.render.lens_table import PAD, LensTable

Float32 = NDArray[np.float32]
Pixel = tuple[float, float]

_MIP_TEXELS = (64, 32, 16, 8, 4)
_OVERSAMPLING = 2
_WINDOW_MARGIN_PX = 4
_NEAREST_M = 0.12
_SPACING_BEYOND_LENS_PX = 30.0
# Measured: with it cornerSubPix finds the demanded rms (interpolation and its window average the error).
_FIELD_GAIN = 1.046
# A card has four layers, grey thrice and its coverage: OpenCV draws four of them in a third of the time of two.
_GREY, _COVERAGE = 0, 3
# The corner error is smooth on a grid this many times finer than its nodes, and linear from there to the pixels.
_STEPS = 5


@dataclass(frozen=True, slots=True)
class Flaws:
    """Errors of a board's picture: of its corners [px rms], defocus [px sigma], smear [px, (2)]."""

    corner_px: float = 0.0
    blur_px: float = 0.0
    smear_px: tuple[float, float] = (0.0, 0.0)


class BoardPainter:
    """Draws the printed card of one marker into pictures, from several resolutions."""

    def __init__(self, card: Card, intrinsics: CameraIntrinsics, table: LensTable) -> None:
        self._intrinsics = intrinsics
        self._table = table
        unit_from_marker = np.diag((1 / card.unit_m, 1 / card.unit_m, 1.0))
        rasters = (card.raster(texels) for texels in _MIP_TEXELS)
        self._mips = [(_with_coverage(grey), texel_from_unit @ unit_from_marker) for grey, texel_from_unit in rasters]
        x0, x1, y0, y1 = card.extent
        # The middles of the four edges first: they give the scale.
        rim = [(x0, (y0 + y1) / 2), (x1, (y0 + y1) / 2), ((x0 + x1) / 2, y0), ((x0 + x1) / 2, y1)]
        rim += [(x, y) for x in (x0, x1) for y in (y0, y1)]
        self._rim = np.column_stack((np.array(rim), np.zeros(len(rim)))) * card.unit_m
        self._units = (x1 - x0) * (y1 - y0)

    def draw(
        self,
        picture: Image,
        optical_from_marker: Pose,
        flaws: Flaws,
        random: np.random.Generator,
        rolling: tuple[Pose, Pose] | None = None,
    ) -> None:
        """Draw the board into the picture, unless it is behind the camera, beyond the border or turned away.

        rolling: its poses when the first and the last row of the picture are exposed.
        """
        poses = rolling or (optical_from_marker,)
        rim = [point for pose in poses for point in pose.apply(self._rim).tolist()]
        faces_camera = float(optical_from_marker.rotation[:, 2] @ optical_from_marker.translation) < 0.0
        if min(depth for _, _, depth in rim) < _NEAREST_M or not faces_camera:
            return
        rim_px = [self._intrinsics.pixel(*point) for point in rim]
        window = self._window(rim_px)
        if window is None:
            return
        x, y = self._table.window(*window)
        spacing = self._spacing_px(rim_px)
        if flaws.corner_px > 0.0:
            x, y = _warped(x, y, flaws.corner_px, spacing, random)
        patch = self._sample(x, y, poses, spacing, window[1])
        _blend(picture, window, _smeared(patch, flaws))

    def _window(self, rim_px: list[Pixel | None]) -> tuple[int, int, int, int] | None:
        seen = [pixel for pixel in rim_px if pixel is not None]
        if not seen:
            return None
        across, down = zip(*seen, strict=True)
        left, top = (max(0, math.floor(min(side)) - _WINDOW_MARGIN_PX) for side in (across, down))
        right, bottom = (math.ceil(max(side)) + _WINDOW_MARGIN_PX + 1 for side in (across, down))
        right, bottom = min(self._table.width, right), min(self._table.height, bottom)
        return (left, top, right, bottom) if right > left and bottom > top else None

    def _spacing_px(self, rim_px: list[Pixel | None]) -> float:
        """Return the side of a unit in the picture (geometric mean of its two directions), from the card's edges."""
        west, east, south, north = rim_px[:4]
        if west is None or east is None or south is None or north is None:
            return _SPACING_BEYOND_LENS_PX
        area = abs((east[0] - west[0]) * (north[1] - south[1]) - (east[1] - west[1]) * (north[0] - south[0]))
        return max(0.5, math.sqrt(area / self._units))

    def _sample(self, x: Float32, y: Float32, poses: tuple[Pose, ...], spacing: float, top: int) -> Float32:
        """Return the window's grey times coverage, and coverage (h, w, 2), for the widened window.

        top: its first row in the picture, for the rolling shutter.
        """
        level = next((i for i, n in enumerate(_MIP_TEXELS) if n <= 1.3 * _OVERSAMPLING * spacing), len(_MIP_TEXELS) - 1)
        texture, texel_from_marker = self._mips[level]
        maps = [_texels(x, y, pose, texel_from_marker) for pose in poses]
        u, v = maps[0]
        if len(maps) == 2:
            share = ((np.arange(len(x), dtype=np.float32) + top - PAD) / (self._table.height - 1))[:, None]
            u, v = u + share * (maps[1][0] - u), v + share * (maps[1][1] - v)
        # Enlarging a smooth map by two gives the rays a quarter pixel to all four sides of each centre.
        size = (_OVERSAMPLING * x.shape[1], _OVERSAMPLING * x.shape[0])
        fine_u, fine_v = (cv2.resize(part, size, interpolation=cv2.INTER_LINEAR) for part in (u, v))
        # Beyond the card's border every layer is 0.
        fine = cv2.remap(texture, fine_u, fine_v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
        layers = cv2.resize(fine, (x.shape[1], x.shape[0]), interpolation=cv2.INTER_AREA)
        # numpy takes seven times as long to pick layers.
        grey, coverage = (cv2.extractChannel(layers, layer) for layer in (_GREY, _COVERAGE))
        return cv2.merge((grey, coverage)).astype(np.float32)


def _texels(x: Float32, y: Float32, pose: Pose, texel_from_marker: Array) -> tuple[Float32, Float32]:
    """Return the points [texels] at which the rays of a window meet the card."""
    optical_from_plane = pose.rotation.copy()
    optical_from_plane[:, 2] = pose.translation
    h = (texel_from_marker @ np.linalg.inv(optical_from_plane)).astype(np.float32)
    scale = 1.0 / (h[2, 0] * x + h[2, 1] * y + h[2, 2])
    return (h[0, 0] * x + h[0, 1] * y + h[0, 2]) * scale, (h[1, 0] * x + h[1, 1] * y + h[1, 2]) * scale


def _with_coverage(picture: Image) -> Image:
    return np.dstack((picture, picture, picture, np.full_like(picture, 255)))


def _warped(
    x: Float32, y: Float32, rms_px: float, spacing: float, random: np.random.Generator
) -> tuple[Float32, Float32]:
    """Return the rays seen through a smooth random displacement, independent from corner to corner."""
    rows, columns = x.shape
    nodes = (max(2, round(rows / spacing) + 1), max(2, round(columns / spacing) + 1))
    field = random.normal(0.0, rms_px * _FIELD_GAIN, (*nodes, 2)).astype(np.float32)
    row, column = rows // 2, columns // 2
    slopes = [(a[row, column + 1] - a[row, column - 1], a[row + 1, column] - a[row - 1, column]) for a in (x, y)]
    size = min(columns, _STEPS * nodes[1]), min(rows, _STEPS * nodes[0])
    shifts = (field @ np.float32(0.5 * np.array(slope)) for slope in slopes)
    smooth = (cv2.resize(shift, size, interpolation=cv2.INTER_CUBIC) for shift in shifts)
    across, down = (cv2.resize(shift, (columns, rows), interpolation=cv2.INTER_LINEAR) for shift in smooth)
    return x + across, y + down


def _smeared(patch: Float32, flaws: Flaws) -> Float32:
    if flaws.blur_px > 0.0:
        patch = np.asarray(cv2.GaussianBlur(patch, (0, 0), flaws.blur_px), dtype=np.float32)
    kernel = smear_kernel(flaws.smear_px)
    return patch if kernel is None else np.asarray(cv2.filter2D(patch, -1, kernel), dtype=np.float32)


def smear_kernel(smear_px: tuple[float, float]) -> Float32 | None:
    """Return the kernel of a straight smear, or None when it is shorter than half a pixel."""
    length = math.hypot(*smear_px)
    if length < 0.5:
        return None
    steps = min(64, math.ceil(length) * 2 + 1)
    half = min(31, math.ceil(length / 2) + 1)
    shares = np.linspace(-0.5, 0.5, steps)
    columns, rows = (np.clip(half + shares * side, 0.0, 2 * half - 1e-6) for side in smear_px)
    j, i = columns.astype(int), rows.astype(int)
    a, b = columns - j, rows - i
    # Splat each instant of the exposure onto its four nearest kernel cells.
    kernel = np.zeros((2 * half + 1, 2 * half + 1), dtype=np.float32)
    for down, across, weight in ((0, 0, (1 - a) * (1 - b)), (0, 1, a * (1 - b)), (1, 0, (1 - a) * b), (1, 1, a * b)):
        np.add.at(kernel, (i + down, j + across), weight / steps)
    return kernel


def _blend(picture: Image, window: tuple[int, int, int, int], patch: Float32) -> None:
    left, top, right, bottom = window
    inner = patch[PAD : PAD + bottom - top, PAD : PAD + right - left]
    below = picture[top:bottom, left:right]
    coverage = inner[..., 1] * np.float32(1 / 255)
    below[...] = (below * (1.0 - coverage) + inner[..., 0] + np.float32(0.5)).astype(np.uint8)
