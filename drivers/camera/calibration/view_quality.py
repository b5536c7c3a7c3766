"""Decides whether a picture of the board is kept, and names the flaw that an operator can mend."""

from collections import Counter
from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np

from drivers.camera.calibration.pattern import Pattern
from groundstation.arrays import Array, Image

# Width of an edge from dark to bright [px]: measured 2.5 to 3.5 on sharp photographs, 8 with 3 px of blur.
_BLURRED_PX = 5.0
_LEAST_SPACING_PX = 8.0
_SIMILAR_SHARE = 0.0125
_NEAR_BORDER_SQUARES = 1.6
_LEAST_SHAPES = 2


class Flaw(StrEnum):
    """Why a picture is not kept; the text is the remedy."""

    NO_BOARD = "no board"
    CUT = "board cut by the picture's border"
    COUNT = "board with another number of corners"
    SMALL = "board too small: go nearer"
    BLURRED = "blurred: hold still, more light"
    SIMILAR = "too similar to one that is kept"


@dataclass(frozen=True, slots=True)
class KeptView:
    """A kept picture: its name, and the corners (n, 2) [px] in it."""

    name: str
    corners: Array


class Judge:
    """Judges pictures; `views` are kept, `flaws` counts the others."""

    def __init__(self, pattern: Pattern, size: tuple[int, int]) -> None:
        self._pattern, self._size = pattern, size
        self.views: list[KeptView] = []
        self.flaws: Counter[Flaw] = Counter()
        self._shapes: Counter[tuple[int, int]] = Counter()

    def look(self, name: str, picture: Image) -> tuple[Flaw | None, Array | None]:
        """Return the flaw (None: the picture was kept), and the corners found."""
        corners = self._pattern.corners(picture)
        flaw = self._without_board(picture) if corners is None else self._flaw_of(picture, corners)
        if flaw is not None:
            self.flaws[flaw] += 1
        elif corners is not None:
            self.views.append(KeptView(name, corners))
        return flaw, corners

    @property
    def other_board(self) -> str:
        """Return the board that pictures seem to show instead of the expected one; "" if unknown."""
        shape, count = self._shapes.most_common(1)[0] if self._shapes else ((0, 0), 0)
        return f"{shape[0]}x{shape[1]}" if count >= max(_LEAST_SHAPES, self._shapes.total() / 3) else ""

    def _flaw_of(self, picture: Image, corners: Array) -> Flaw | None:
        if self._pattern.spacing_px(corners) < _LEAST_SPACING_PX:
            return Flaw.SMALL
        if self._edge_px(picture, corners) > _BLURRED_PX:
            return Flaw.BLURRED
        moved = (np.hypot(*(corners - view.corners).T).mean() for view in self.views)
        return Flaw.SIMILAR if min(moved, default=np.inf) < _SIMILAR_SHARE * self._size[0] else None

    def _edge_px(self, picture: Image, corners: Array) -> float:
        shape = (self._pattern.columns, self._pattern.rows)
        points = corners.astype(np.float32).reshape(-1, 1, 2)
        try:
            return float(np.ravel(cv2.estimateChessboardSharpness(picture, shape, points)[0])[0])
        except cv2.error:  # squares at the border: nothing to measure an edge on
            return 0.0

    def _without_board(self, picture: Image) -> Flaw:
        """Return the flaw of a picture without the whole board: it is cut at the border, or of another size."""
        if self._pattern.is_marker:
            return Flaw.NO_BOARD
        found, raw, meta = cv2.findChessboardCornersSBWithMeta(picture, (3, 3), cv2.CALIB_CB_LARGER)
        if not found or raw is None:
            return Flaw.NO_BOARD
        rows, columns = np.shape(meta)[:2]
        wanted = {self._pattern.columns, self._pattern.rows}
        if {rows, columns} == wanted:
            return Flaw.NO_BOARD
        corners = np.asarray(raw, dtype=np.float64).reshape(-1, 2)
        side = np.hypot(*(corners[1] - corners[0]))
        low, high = corners.min(axis=0), np.array(self._size) - corners.max(axis=0)
        if min(low.min(), high.min()) < _NEAR_BORDER_SQUARES * side and rows * columns < np.prod(list(wanted)):
            return Flaw.CUT
        self._shapes[max(rows, columns), min(rows, columns)] += 1
        return Flaw.COUNT
