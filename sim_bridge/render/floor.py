"""The floor: a seeded carpet with stains, tape and cables, seen through the lens."""

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.geometry.pose import Pose
from sim_bridge.render.lens_table import LensTable

Picture = NDArray[np.uint8]

_TEXEL_M = 0.008
_BEYOND_M = 1.0
_WALL_GREY = 150
_FARTHEST_M = 40.0


def carpet(size_m: tuple[float, float], seed: int) -> Picture:
    """Return a floor texture (8 mm per texel) that reaches 1 m beyond the room; row 0 is the +y edge."""
    random = np.random.default_rng(seed)
    width, height = (round((side + 2 * _BEYOND_M) / _TEXEL_M) for side in size_m)
    tone = np.full((height, width), 125.0, dtype=np.float32)
    for cells, amplitude in ((6, 14.0), (40, 9.0), (200, 8.0)):
        coarse = random.normal(0.0, amplitude, (max(2, cells * height // width), cells)).astype(np.float32)
        tone += cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    tone += cv2.GaussianBlur(random.normal(0.0, 16.0, tone.shape).astype(np.float32), (0, 0), 0.8)
    texture = np.clip(tone, 20, 235).astype(np.uint8)
    _strew(texture, random)
    return np.asarray(cv2.GaussianBlur(texture, (0, 0), 0.6), dtype=np.uint8)


def _strew(texture: Picture, random: np.random.Generator) -> None:
    """Draw what lies about in a lab: tiles with joints, cables, tape, stains."""
    height, width = texture.shape
    joint = round(0.6 / _TEXEL_M)
    for x in range(joint // 2, width, joint):
        cv2.line(texture, (x, 0), (x, height), 95, 1)
    for y in range(joint // 2, height, joint):
        cv2.line(texture, (0, y), (width, y), 95, 1)
    for _ in range(6):
        points = np.cumsum(random.normal(0, 40, (8, 2)), axis=0) + random.uniform(0, 1, 2) * (width, height)
        cv2.polylines(texture, [points.astype(np.int32)], False, int(random.integers(25, 60)), 2, cv2.LINE_AA)
    for _ in range(14):
        centre, axes = random.uniform(0, 1, 2) * (width, height), random.uniform(4, 30, 2)
        shade, turn = int(random.integers(50, 220)), float(random.uniform(0, 180))
        if random.random() < 0.5:
            box = cv2.boxPoints((tuple(centre), tuple(2 * axes), turn))
            cv2.fillConvexPoly(texture, box.astype(np.int32), shade, cv2.LINE_AA)
        else:
            cv2.ellipse(texture, (tuple(centre), tuple(2 * axes), turn), shade, -1, cv2.LINE_AA)


class Floor:
    """Draws the floor plane z = 0 for a camera pose."""

    def __init__(self, texture: Picture, size_m: tuple[float, float], table: LensTable) -> None:
        self._texture = texture
        self._half = (size_m[0] / 2 + _BEYOND_M, size_m[1] / 2 + _BEYOND_M)
        self._table = table

    def draw(self, world_from_optical: Pose) -> Picture:
        """Return the picture of the bare floor; what lies beyond its edge is wall."""
        r = world_from_optical.rotation.astype(np.float32)
        centre = world_from_optical.translation
        x, y = self._table.coarse_x, self._table.coarse_y
        down = -(r[2, 0] * x + r[2, 1] * y + r[2, 2])
        # Rays that do not come down meet the floor "very far away", where it is no longer floor.
        distance = np.minimum(np.float32(centre[2]) / np.maximum(down, 1e-4), np.float32(_FARTHEST_M))
        floor_x = np.float32(centre[0]) + distance * (r[0, 0] * x + r[0, 1] * y + r[0, 2])
        floor_y = np.float32(centre[1]) + distance * (r[1, 0] * x + r[1, 1] * y + r[1, 2])
        columns = (floor_x + np.float32(self._half[0])) / np.float32(_TEXEL_M) - np.float32(0.5)
        rows = (np.float32(self._half[1]) - floor_y) / np.float32(_TEXEL_M) - np.float32(0.5)
        picture = cv2.remap(
            self._texture,
            self._table.enlarge(columns),
            self._table.enlarge(rows),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=_WALL_GREY,
        )
        return np.asarray(picture, dtype=np.uint8)
