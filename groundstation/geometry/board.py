"""The marker: a checkerboard of 5 x 4 squares beside a bar of 8 cells that identifies its carrier.

Marker frame: origin at the centre of the checkerboard, x along the side of five squares (the bar lies beyond its
positive end), y to the left, z out of the face. Seen from above with x to the right:

       y
       ^   # . # . #   |c0|      rows of squares from y = +2 down to y = -2 squares; the left (+y) edge has black
       |   . # . # .   |c1|      ends, so the two ways round are told apart by colour (5 odd, 4 even)
       |   # . # . #   |..|
       |   . # . # .   |c7|      cells from y = +2 down to y = -2 squares, 0.5 square each; black is 1
       +------------------> x
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.arrays import Array

SQUARES_X, SQUARES_Y = 5, 4
CORNERS_X, CORNERS_Y = SQUARES_X - 1, SQUARES_Y - 1
CORNERS = CORNERS_X * CORNERS_Y
CELLS = 8
# In squares; with 44 mm squares the printed card is 290 mm x 210 mm.
BAR_GAP = 0.35
BAR_WIDTH = 28.0 / 44.0
MARGIN_X = 0.30
MARGIN_Y = 0.386
_BAR_X = SQUARES_X / 2 + BAR_GAP
# Extent of the card in squares: x_min, x_max, y_min, y_max.
EXTENT = (-SQUARES_X / 2 - MARGIN_X, _BAR_X + BAR_WIDTH + MARGIN_X, -SQUARES_Y / 2 - MARGIN_Y, SQUARES_Y / 2 + MARGIN_Y)
BLACK, WHITE = 25, 230


# Unmasked, blank paper and a solid dark strip would be words of the code; masked, each is two cells away from four
# words at once, so neither can be read as an identity. Of all masks and orders of the cells these keep the words
# farthest apart when small cells run into each other (docs/decisions/0051-masked-code-words.md).
_MASK = np.array([1, 0, 0, 1, 0, 0, 0, 0], dtype=np.int8)
CODES = 16


def _code_words() -> NDArray[np.int8]:
    words = np.zeros((CODES, CELLS), dtype=np.int8)
    for code in range(CODES):
        d = [code >> bit & 1 for bit in (3, 2, 1, 0)]
        parity = [d[0] ^ d[1] ^ d[3], d[0] ^ d[2] ^ d[3], d[1] ^ d[2] ^ d[3]]
        words[code] = [*d, sum(d + parity) % 2, *parity]
    return np.asarray(words ^ _MASK)


# Extended Hamming code (8, 4), cells reordered and masked: any two words differ in at least four cells.
CODE_WORDS = _code_words()
CODE_WORDS.setflags(write=False)
VALID_CODES = tuple(range(CODES))


@dataclass(frozen=True, slots=True)
class Checkerboard:
    """One printed marker: its code (0..15) and the side of its squares [mm]."""

    code: int
    square_mm: float

    def __post_init__(self) -> None:
        if self.code not in VALID_CODES:
            raise ValueError(f"code must be in 0..15 (got {self.code})")
        if not self.square_mm > 0.0:
            raise ValueError(f"square_mm must be positive (got {self.square_mm})")

    @property
    def square_m(self) -> float:
        """Return the side of a square [m]."""
        return self.square_mm / 1000.0

    def corners(self) -> Array:
        """Return the inner corners (12, 3) [m; marker frame], in the order of `corner_grid`."""
        return _raised(corner_grid()) * self.square_m

    def outline(self) -> Array:
        """Return the four corners of the printed card (4, 3) [m; marker frame], counter-clockwise."""
        x0, x1, y0, y1 = EXTENT
        return _raised(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])) * self.square_m

    def radius_m(self) -> float:
        """Return the distance from the origin to the farthest corner of the card [m]."""
        return float(np.linalg.norm(self.outline(), axis=1).max())


def _raised(plane: Array) -> Array:
    return np.column_stack((plane, np.zeros(len(plane))))


def corner_grid() -> Array:
    """Return the inner corners (12, 2) in squares: rows of four along +x, the row at y = +1 (black end) first."""
    x = np.arange(CORNERS_X) - (CORNERS_X - 1) / 2
    y = (CORNERS_Y - 1) / 2 - np.arange(CORNERS_Y)
    return np.array([[a, b] for b in y for a in x])


def square_centres() -> tuple[Array, NDArray[np.bool_]]:
    """Return the centres of the 20 squares (20, 2) in squares, and which of them are black."""
    cells = [(i, j) for j in range(SQUARES_Y) for i in range(SQUARES_X)]
    centres = np.array([[i + 0.5 - SQUARES_X / 2, SQUARES_Y / 2 - j - 0.5] for i, j in cells])
    return centres, np.array([(i + j) % 2 == 0 for i, j in cells])


def cell_centres() -> Array:
    """Return the centres of the 8 cells of the bar (8, 2) in squares."""
    pitch = SQUARES_Y / CELLS
    return np.array([[_BAR_X + BAR_WIDTH / 2, SQUARES_Y / 2 - pitch * (cell + 0.5)] for cell in range(CELLS)])


def dark_rectangles(code: int) -> list[tuple[float, float, float, float]]:
    """Return x0, x1, y0, y1 in squares of all black rectangles."""
    centres, black = square_centres()
    rectangles = [(x - 0.5, x + 0.5, y - 0.5, y + 0.5) for x, y in centres[black]]
    half = SQUARES_Y / CELLS / 2
    for (_, y), bit in zip(cell_centres(), CODE_WORDS[code], strict=True):
        if bit:
            rectangles.append((_BAR_X, _BAR_X + BAR_WIDTH, y - half, y + half))
    return rectangles


def _coverage(edges: Array, low: float, high: float) -> Array:
    """Return the share of each interval between successive edges that lies in [low, high]."""
    return np.asarray(np.clip(np.minimum(edges[1:], high) - np.maximum(edges[:-1], low), 0.0, None) / np.diff(edges))


def raster(code: int, texels_per_square: float) -> tuple[NDArray[np.uint8], Array]:
    """Return the printed card as a grey picture, and texel_from_marker (3, 3) for points in squares.

    Each texel is the exact mean over its area; texel i covers [i - 0.5, i + 0.5]. Row 0 is the +y edge.
    """
    x0, x1, y0, y1 = EXTENT
    columns = max(1, round((x1 - x0) * texels_per_square))
    rows = max(1, round((y1 - y0) * texels_per_square))
    x_edges, y_edges = np.linspace(x0, x1, columns + 1), np.linspace(y0, y1, rows + 1)
    dark = np.zeros((rows, columns))
    for low_x, high_x, low_y, high_y in dark_rectangles(code):
        dark += np.outer(_coverage(y_edges, low_y, high_y), _coverage(x_edges, low_x, high_x))
    picture = np.rint(WHITE + (BLACK - WHITE) * np.clip(dark, 0.0, 1.0))[::-1].astype(np.uint8)
    scale_x, scale_y = columns / (x1 - x0), rows / (y1 - y0)
    texel_from_marker = np.array(
        [[scale_x, 0.0, -x0 * scale_x - 0.5], [0.0, -scale_y, y1 * scale_y - 0.5], [0.0, 0.0, 1.0]]
    )
    return picture, texel_from_marker
