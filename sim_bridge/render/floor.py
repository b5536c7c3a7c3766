"""The floor: carpet, planks, concrete or tiles, seeded, with stains, tape and cables, seen through the lens."""

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.arrays import Image
from groundstation.geometry.pose import Pose
from sim_bridge.render.lens_table import LensTable
from sim_bridge.render.spec import FloorKind

_TEXEL_M = 0.008
_BEYOND_M = 1.0
_WALL_GREY = 150
_FARTHEST_M = 40.0


def texture(kind: FloorKind, size_m: tuple[float, float], seed: int) -> Image:
    """Return the picture of a floor (8 mm per texel), 1 m wider than the room on all sides; row 0 is the +y edge."""
    random = np.random.default_rng(seed)
    width, height = (round((side + 2 * _BEYOND_M) / _TEXEL_M) for side in size_m)
    tone = np.full((height, width), 125.0, dtype=np.float32)
    match kind:
        case FloorKind.CARPET:
            _roughen(tone, random, ((6, 14.0), (40, 9.0), (200, 8.0)), 16.0)
        case FloorKind.WOOD:
            _lay_planks(tone, random)
        case FloorKind.CONCRETE:
            _roughen(tone, random, ((4, 10.0), (12, 6.0)), 4.0)
        case FloorKind.TILES:
            _lay_tiles(tone)
            _roughen(tone, random, ((6, 8.0),), 4.0)
    laid = np.clip(tone, 20, 235).astype(np.uint8)
    _strew(laid, random, joints=kind is FloorKind.CARPET)
    return np.asarray(cv2.GaussianBlur(laid, (0, 0), 0.6), dtype=np.uint8)


def _roughen(
    tone: NDArray[np.float32], random: np.random.Generator, waves: tuple[tuple[int, float], ...], grain: float
) -> None:
    """Add smooth shades with `waves` cells across, and grain [rms grey levels]."""
    height, width = tone.shape
    for cells, amplitude in waves:
        coarse = random.normal(0.0, amplitude, (max(2, cells * height // width), cells)).astype(np.float32)
        tone += cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    tone += cv2.GaussianBlur(random.normal(0.0, grain, tone.shape).astype(np.float32), (0, 0), 0.8)


def _lay_planks(tone: NDArray[np.float32], random: np.random.Generator) -> None:
    """Lay planks of 12 cm along x, of varying shade, with grain and dark joints."""
    height, width = tone.shape
    plank = round(0.12 / _TEXEL_M)
    for top in range(0, height, plank):
        left = -int(random.integers(0, 200))
        while left < width:
            length = int(random.integers(120, 260))
            part = tone[top : top + plank, max(0, left) : max(0, left + length)]
            part += np.float32(random.normal(0.0, 18.0))
            part[:, :1] = 60.0
            left += length
        tone[top : top + 1] = 60.0
    grain = random.normal(0.0, 22.0, (height, max(2, width // 40))).astype(np.float32)
    tone += cv2.resize(grain, (width, height), interpolation=cv2.INTER_CUBIC)


def _lay_tiles(tone: NDArray[np.float32]) -> None:
    """Lay black and white tiles of 30 cm: full of saddle points that are no marker."""
    side = 0.3 / _TEXEL_M
    rows, columns = (np.arange(length) // side for length in tone.shape)
    tone += np.where((rows[:, None] + columns[None]) % 2 == 0, 70.0, -70.0).astype(np.float32)


def _strew(floor: Image, random: np.random.Generator, joints: bool) -> None:
    """Draw clutter of a lab: joints of carpet tiles, cables, tape, stains."""
    height, width = floor.shape
    if joints:
        joint = round(0.6 / _TEXEL_M)
        for x in range(joint // 2, width, joint):
            cv2.line(floor, (x, 0), (x, height), 95, 1)
        for y in range(joint // 2, height, joint):
            cv2.line(floor, (0, y), (width, y), 95, 1)
    for _ in range(6):
        points = np.cumsum(random.normal(0, 40, (8, 2)), axis=0) + random.uniform(0, 1, 2) * (width, height)
        cv2.polylines(floor, [points.astype(np.int32)], False, int(random.integers(25, 60)), 2, cv2.LINE_AA)
    for _ in range(14):
        centre, axes = random.uniform(0, 1, 2) * (width, height), random.uniform(4, 30, 2)
        shade, turn = int(random.integers(50, 220)), float(random.uniform(0, 180))
        if random.random() < 0.5:
            box = cv2.boxPoints((tuple(centre), tuple(2 * axes), turn))
            cv2.fillConvexPoly(floor, box.astype(np.int32), shade, cv2.LINE_AA)
        else:
            cv2.ellipse(floor, (tuple(centre), tuple(2 * axes), turn), shade, -1, cv2.LINE_AA)


class Floor:
    """Draws the floor plane z = 0 for a camera pose."""

    def __init__(self, texture: Image, size_m: tuple[float, float], table: LensTable) -> None:
        self._texture = texture
        self._half = (size_m[0] / 2 + _BEYOND_M, size_m[1] / 2 + _BEYOND_M)
        self._table = table

    def draw(self, world_from_optical: Pose, rolling: tuple[Pose, Pose] | None = None) -> Image:
        """Return the picture of the bare floor; beyond its edge there is wall.

        rolling: the camera's poses when the first and the last row are exposed.
        """
        columns, rows = self._texels(world_from_optical if rolling is None else rolling[0])
        if rolling is not None:
            last_columns, last_rows = self._texels(rolling[1])
            share = self._table.coarse_share
            columns, rows = columns + share * (last_columns - columns), rows + share * (last_rows - rows)
        picture = cv2.remap(
            self._texture,
            self._table.enlarge(columns),
            self._table.enlarge(rows),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=_WALL_GREY,
        )
        return np.asarray(picture, dtype=np.uint8)

    def _texels(self, world_from_optical: Pose) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the points at which the coarse rays meet the floor, in texels (columns, rows)."""
        r = world_from_optical.rotation.astype(np.float32)
        centre = world_from_optical.translation
        x, y = self._table.coarse_x, self._table.coarse_y
        down = -(r[2, 0] * x + r[2, 1] * y + r[2, 2])
        # Rays that do not point down get a point very far away, beyond the floor's edge.
        distance = np.minimum(np.float32(centre[2]) / np.maximum(down, 1e-4), np.float32(_FARTHEST_M))
        floor_x = np.float32(centre[0]) + distance * (r[0, 0] * x + r[0, 1] * y + r[0, 2])
        floor_y = np.float32(centre[1]) + distance * (r[1, 0] * x + r[1, 1] * y + r[1, 2])
        columns = (floor_x + np.float32(self._half[0])) / np.float32(_TEXEL_M) - np.float32(0.5)
        rows = (np.float32(self._half[1]) - floor_y) / np.float32(_TEXEL_M) - np.float32(0.5)
        return columns, rows
