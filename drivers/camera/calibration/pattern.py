"""The board for measuring a lens: any checkerboard, or one of our own markers, and where its corners are."""

import re
from dataclasses import dataclass

import cv2
import numpy as np

from drivers.camera.detect import refined
from drivers.camera.search import search
from groundstation.arrays import Array, Image
from groundstation.geometry import board as marker

MARKER = "skein"
_FLAGS = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
_OPENCV_HALF_PX = 11
_OPENCV_REFINE = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 30, 0.01)
_LEAST, _MOST = 3, 30


@dataclass(frozen=True, slots=True)
class Pattern:
    """A checkerboard with given numbers of inner corners along its sides; square_mm: the side of a square.

    is_marker: whether it is one of our markers, whose identity bar does not matter. as_opencv: corners are refined in a
    fixed window of 23 px as in OpenCV's samples, which published calibrations mostly come from; small squares suffer
    from it.
    """

    columns: int
    rows: int
    square_mm: float
    is_marker: bool = False
    as_opencv: bool = False

    @property
    def points(self) -> Array:
        """Return its corners (n, 3) [m; board]."""
        grid = [[x, y, 0.0] for y in range(self.rows) for x in range(self.columns)]
        return np.array(grid) * (self.square_mm / 1000.0)

    @property
    def label(self) -> str:
        """Return the operator's name for it."""
        return "marker" if self.is_marker else f"{self.columns}x{self.rows} board"

    def corners(self, picture: Image) -> Array | None:
        """Return its corners (n, 2) [px] to fractions of a pixel, or None if it is not wholly in the picture."""
        if self.is_marker:
            finds = search(picture, [])
            largest = max(finds, key=lambda find: float(np.ptp(find.corners, axis=0).max()), default=None)
            return None if largest is None else largest.corners
        found, raw = cv2.findChessboardCorners(picture, (self.columns, self.rows), flags=_FLAGS)
        if not found or raw is None:
            return None
        coarse = np.asarray(raw, dtype=np.float64).reshape(-1, 2)
        if not self.as_opencv:
            return refined(picture, coarse, self.columns)
        start = coarse.astype(np.float32).reshape(-1, 1, 2)
        half = (_OPENCV_HALF_PX, _OPENCV_HALF_PX)
        return np.asarray(cv2.cornerSubPix(picture, start, half, (-1, -1), _OPENCV_REFINE), np.float64).reshape(-1, 2)

    def spacing_px(self, corners: Array) -> float:
        """Return the mean distance of neighbouring corners [px]."""
        grid = corners.reshape(self.rows, self.columns, 2)
        steps = (np.diff(grid, axis=0).reshape(-1, 2), np.diff(grid, axis=1).reshape(-1, 2))
        return float(np.mean([np.hypot(*step.T).mean() for step in steps]))


def pattern_of(text: str, square_mm: float, as_opencv: bool = False) -> Pattern:
    """Return the pattern that `9x6` (inner corners) or `skein` names; raises ValueError with the fault."""
    if not 1.0 <= square_mm <= 1000.0:
        raise ValueError(f"the side of a square must be 1 to 1000 mm (got {square_mm:g})")
    if text == MARKER:
        return Pattern(marker.CORNERS_X, marker.CORNERS_Y, square_mm, is_marker=True)
    match = re.fullmatch(r"(\d+)x(\d+)", text)
    if match is None:
        raise ValueError(f"{text!r} is no board: inner corners along its sides such as 9x6, or {MARKER}")
    columns, rows = int(match[1]), int(match[2])
    if not (min(columns, rows) >= _LEAST and max(columns, rows) <= _MOST):
        raise ValueError(f"a board has {_LEAST} to {_MOST} inner corners along each side (got {text})")
    return Pattern(columns, rows, square_mm, as_opencv=as_opencv)
