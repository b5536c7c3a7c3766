"""Draws an upright box with a ray for each pixel of its window, and tells which points it may hide."""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.arrays import Array, Image
from groundstation.geometry.pose import Pose
from sim_bridge.render.lens_table import COARSE, NOWHERE, PAD, Float32, LensTable

# Sides across x and y, and top: light comes from above.
_GREYS = np.array([95, 120, 150], dtype=np.uint8)
_LEAST_BLUR_PX = 0.5


class Cover(NamedTuple):
    """What a box covers: window left, top, right, bottom [px], coverage (h, w) of 0 to 1, grey (h, w)."""

    window: tuple[int, int, int, int]
    coverage: Float32
    grey: Image

    def over(self, picture: Image) -> None:
        """Draw the box into the picture."""
        self._blend(picture, self.grey)

    def keep(self, picture: Image, before: Image) -> None:
        """Undo, where the box is, what was drawn since `before`."""
        left, top, right, bottom = self.window
        self._blend(picture, before[top:bottom, left:right])

    def _blend(self, picture: Image, above: Image) -> None:
        left, top, right, bottom = self.window
        below = picture[top:bottom, left:right]
        below[...] = (below + self.coverage * (above.astype(np.float32) - below) + np.float32(0.5)).astype(np.uint8)


class BoxPainter:
    """Draws one box of a size [m] along x, y, z that stands on the floor."""

    def __init__(self, size_m: tuple[float, float, float], focal_px: float, blur_px: float, table: LensTable) -> None:
        self._half = np.array([size_m[0] / 2, size_m[1] / 2, 0.0])
        self._top = np.array([0.0, 0.0, size_m[2]])
        self._step = COARSE / focal_px
        self._blur_px = max(blur_px, _LEAST_BLUR_PX)
        self._table = table

    def cover(self, place_m: Array, world_from_optical: Pose) -> Cover | None:
        """Return the pixels that it covers from a camera pose, None for none; place_m: x, y, z of its foot."""
        low, high = self._corners(place_m)
        window = self._window(low, high, world_from_optical)
        if window is None:
            return None
        x, y = (rays[PAD:-PAD, PAD:-PAD] for rays in self._table.window(*window))
        hit, face = _meet(x, y, low, high, world_from_optical)
        if not hit.any():
            return None
        coverage = np.asarray(cv2.GaussianBlur(hit.astype(np.float32), (5, 5), self._blur_px), dtype=np.float32)
        grey = cv2.medianBlur(_GREYS[face], 3)  # at the rim a ray beside the box has no face
        return Cover(window, coverage, np.asarray(grey, dtype=np.uint8))

    def may_hide(self, point: Array, place_m: Array, world_from_optical: Pose) -> bool:
        """Return whether it may lie between the camera and a point [world]: no face has both before it."""
        low, high = self._corners(place_m)
        eye = world_from_optical.translation
        before = ((eye < low) & (point < low)) | ((eye > high) & (point > high))
        return not before.any()

    def _corners(self, place_m: Array) -> tuple[Array, Array]:
        return place_m - self._half, place_m + self._half + self._top

    def _window(self, low: Array, high: Array, world_from_optical: Pose) -> tuple[int, int, int, int] | None:
        """Return a window around the box: that of the coarse rays which meet it with a rim of their own distance."""
        rim = self._step * float(np.linalg.norm((low + high) / 2 - world_from_optical.translation))
        table = self._table
        hit, _ = _meet(table.coarse_x, table.coarse_y, low - rim, high + rim, world_from_optical)
        rows, columns = (np.flatnonzero(hit.any(axis=axis)) for axis in (1, 0))
        if not len(rows):
            return None
        left, top = (max(0, (int(cells[0]) - 2) * COARSE) for cells in (columns, rows))
        right = min(table.width, (int(columns[-1]) + 1) * COARSE)
        bottom = min(table.height, (int(rows[-1]) + 1) * COARSE)
        return (left, top, right, bottom) if right > left and bottom > top else None


def _meet(
    x: Float32, y: Float32, low: Array, high: Array, world_from_optical: Pose
) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Return which rays meet the box before the camera, and the axis of the face that they enter by (h, w)."""
    rotation, eye = world_from_optical.rotation.astype(np.float32), world_from_optical.translation
    enters, leaves = np.full(x.shape, -np.inf, dtype=np.float32), np.full(x.shape, np.inf, dtype=np.float32)
    face = np.zeros(x.shape, dtype=np.intp)
    for axis in range(3):
        ahead = rotation[axis, 0] * x + rotation[axis, 1] * y + rotation[axis, 2]
        ahead = np.where(np.abs(ahead) < 1e-6, np.float32(1e-6), ahead)
        one, two = (np.float32(side[axis] - eye[axis]) / ahead for side in (low, high))
        near = np.minimum(one, two)
        face[near > enters] = axis
        enters, leaves = np.maximum(enters, near), np.minimum(leaves, np.maximum(one, two))
    return (enters < leaves) & (leaves > 0.0) & (np.abs(x) < NOWHERE), face
