"""Finds one checkerboard in one window of a picture, and puts its twelve corners into the marker's own order."""

import math
from dataclasses import dataclass
from statistics import median
from typing import NamedTuple

import cv2
import numpy as np

from groundstation.arrays import Array, Image
from groundstation.geometry import board as marker

# Measured: the finder wants 10-12 px per square, 18 is safe and still cheap.
_WANTED_PX_PER_SQUARE = 18.0
_LEAST_ENLARGEMENT, _MOST_ENLARGEMENT = 0.4, 6.0
# Equalising the histogram first (CALIB_CB_NORMALIZE_IMAGE) costs time and every tenth board with small squares.
_FLAGS = cv2.CALIB_CB_ADAPTIVE_THRESH
_REFINE = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 30, 0.005)
# Half a refinement window at most [px]: enlarged pictures are sharp enough for all of it, others need no more.
_MOST_HALF_ENLARGED_PX, _MOST_HALF_PX = 10, 8
# The finder raises an error for smaller pictures, which hold no board.
_LEAST_SIDE_PX = 20
_LEAST_CONTRAST = 12.0
_MOST_WRONG_SQUARES = 1
# Corners that are followed lie on one plane to within noise and the lens's bend over a marker.
_MOST_OFF_PLANE_PX, _MOST_OFF_PLANE_SQUARES = 0.5, 0.1
_GRID = marker.corner_grid()
_CENTRES, _BLACK = marker.square_centres()
# Five points around each centre: a single sample would depend on one noisy pixel.
_SPREAD = np.array([[0.0, 0.0], [0.18, 0.18], [0.18, -0.18], [-0.18, 0.18], [-0.18, -0.18]])
_X0, _X1, _Y0, _Y1 = marker.EXTENT
_CARD = np.array([[_X0, _Y0], [_X1, _Y0], [_X1, _Y1], [_X0, _Y1]])
_SQUARE_SAMPLES = (_CENTRES[:, None] + _SPREAD).reshape(-1, 2)


def _step_out(square: Array, side: int) -> tuple[float, float] | None:
    """Return a point on the paper beside a border square, on one of the sides +x, -x, +y, -y; None if not there."""
    x, y = float(square[0]), float(square[1])
    sign = 1.0 if side % 2 == 0 else -1.0
    if side < 2:
        return (sign * 2.65, y) if x * sign == 2.0 else None
    return (x, sign * 2.17) if y * sign == 1.5 else None


# The paper just outside of the white squares of each border; blur darkens it beside the black ones.
_RIM_SIDES = tuple(
    np.array([outside for square in _CENTRES[~_BLACK] if (outside := _step_out(square, side)) is not None])
    for side in range(4)
)
_RIM, _RIM_COUNTS = np.vstack(_RIM_SIDES), np.array([len(side) for side in _RIM_SIDES])
_RIM_STARTS = np.cumsum(_RIM_COUNTS) - _RIM_COUNTS
_LEAST_RIM_WHITENESS = 0.35


class Window(NamedTuple):
    """Part of a picture: left and top inclusive, right and bottom exclusive [px]."""

    left: int
    top: int
    right: int
    bottom: int


@dataclass(frozen=True, slots=True)
class Find:
    """Corners (12, 2) [px] in marker order, and the grey levels of its white and black squares."""

    corners: Array
    white: float
    black: float

    @property
    def centre(self) -> Array:
        """Return the mean of the corners [px]."""
        return np.asarray(np.add.reduce(self.corners) / len(self.corners))


def spacing_px(corners: Array) -> float:
    """Return the least distance of neighbouring corners [px]."""
    grid = corners.reshape(marker.CORNERS_Y, marker.CORNERS_X, 2)
    along, across = grid[:, 1:] - grid[:, :-1], grid[1:] - grid[:-1]
    return math.sqrt(min((along * along).sum(axis=-1).min(), (across * across).sum(axis=-1).min()))


def window_around(points: Array, margin_px: float, shape: tuple[int, ...]) -> Window | None:
    """Return the window that holds points (n, 2) and a margin, cut at the picture's border; None if none is left."""
    low, high = points.min(axis=0) - margin_px, points.max(axis=0) + margin_px
    left, top = max(0, int(low[0])), max(0, int(low[1]))
    right, bottom = min(shape[1], int(high[0]) + 2), min(shape[0], int(high[1]) + 2)
    return Window(left, top, right, bottom) if right - left >= 12 and bottom - top >= 12 else None


def enlargement(spacing: float) -> float:
    """Return by how much a picture is scaled for the board finder when squares are about `spacing` pixels wide."""
    return min(max(_WANTED_PX_PER_SQUARE / max(spacing, 1.0), _LEAST_ENLARGEMENT), _MOST_ENLARGEMENT)


def find_board(picture: Image, window: Window, spacing: float) -> Find | None:
    """Return the board in the window with squares about `spacing` pixels wide, or None."""
    part = picture[window.top : window.bottom, window.left : window.right]
    enlarged, ratio = resized(part, enlargement(spacing))
    if min(enlarged.shape) < _LEAST_SIDE_PX:
        return None
    found, raw = cv2.findChessboardCorners(enlarged, (marker.CORNERS_X, marker.CORNERS_Y), flags=_FLAGS)
    if not found or raw is None:
        return None
    coarse = (np.asarray(raw, dtype=np.float64).reshape(-1, 2) + 0.5) * ratio - 0.5 + (window.left, window.top)
    return ordered(picture, refined(picture, coarse))


def follow_board(picture: Image, expected: Array) -> Find | None:
    """Return the board whose corners (12, 2) [px] are expected to within a third of a square, or None.

    It costs a third of `find_board`: its corners are refined from where they are expected, and must all be there and
    lie on one plane.
    """
    reach = _least_distance(expected, marker.CORNERS_X)
    if min(expected.min(), *(picture.shape[::-1] - expected.max(axis=0))) < reach + 3.0:  # partly outside
        return None
    fine, slipped = _refined(picture, expected, reach)
    if fine is None or slipped.any():
        return None
    off = _mapped(homography(_GRID, fine), _GRID) - fine
    if np.hypot(*off.T).max() > max(_MOST_OFF_PLANE_PX, _MOST_OFF_PLANE_SQUARES * spacing_px(fine)):
        return None
    return ordered(picture, fine)


def refined(picture: Image, corners: Array, columns: int = marker.CORNERS_X) -> Array:
    """Return lattice corners (n, 2) refined to sub-pixels; `columns` of them make a row.

    A corner that would slip away by a good part of a square stays where it was.
    """
    fine, slipped = _refined(picture, corners, _least_distance(corners, columns))
    return corners if fine is None else np.where(slipped[:, None], corners, fine)


def _refined(picture: Image, corners: Array, reach: float) -> tuple[Array | None, Array]:
    """Return refined corners, None outside of the picture, and which of them slipped by a good part of a square.

    reach: least distance of neighbours [px].
    Small squares are enlarged first: a window of a whole number of pixels is too coarse for them. It reaches 0.55
    squares, never a neighbour.
    """
    window = window_around(corners, reach + 2.0, picture.shape)
    if window is None:
        return None, np.ones(len(corners), dtype=bool)
    part = picture[window.top : window.bottom, window.left : window.right]
    enlarged, ratio = resized(part, min(max(_WANTED_PX_PER_SQUARE / max(reach, 1.0), 1.0), _MOST_ENLARGEMENT))
    most = _MOST_HALF_ENLARGED_PX if ratio[0] < 1.0 else _MOST_HALF_PX
    half = min(max(round(0.55 * reach / ratio[0]), 1), most)
    start = ((corners - (window.left, window.top) + 0.5) / ratio - 0.5).astype(np.float32).reshape(-1, 1, 2)
    found = cv2.cornerSubPix(enlarged, start, (half, half), (-1, -1), _REFINE)
    fine = (np.asarray(found, np.float64).reshape(-1, 2) + 0.5) * ratio - 0.5 + (window.left, window.top)
    return fine, np.hypot(*(fine - corners).T) > max(1.5, 0.3 * reach)


def resized(part: Image, scale: float) -> tuple[Image, Array]:
    """Return a picture scaled by about `scale`, and the size of its pixels in pixels of the original (2)."""
    if abs(scale - 1.0) <= 0.1:
        return part, np.ones(2)
    interpolation = cv2.INTER_CUBIC if scale > 1.0 else cv2.INTER_AREA
    size = (max(12, round(part.shape[1] * scale)), max(12, round(part.shape[0] * scale)))
    scaled = np.asarray(cv2.resize(part, size, interpolation=interpolation), dtype=np.uint8)
    return scaled, np.array([part.shape[1] / size[0], part.shape[0] / size[1]])


def _least_distance(corners: Array, columns: int) -> float:
    """Return the least distance of neighbours of a lattice [px], diagonals included: slanted views have them near."""
    grid = corners.reshape(-1, columns, 2)
    steps = (
        grid[:, 1:] - grid[:, :-1],
        grid[1:] - grid[:-1],
        grid[1:, 1:] - grid[:-1, :-1],
        grid[1:, :-1] - grid[:-1, 1:],
    )
    return float(min(np.hypot(step[..., 0], step[..., 1]).min() for step in steps))


def ordered(picture: Image, corners: Array) -> Find | None:
    """Return the corners in marker order, black end first; None unless they bound a checkerboard with a white rim."""
    grid = corners.reshape(marker.CORNERS_Y, marker.CORNERS_X, 2)
    along, across = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    if along[0] * across[1] - along[1] * across[0] < 0.0:
        grid = grid[:, ::-1]
    corners = grid.reshape(-1, 2)
    pixels_from_plane = homography(_GRID, corners)
    grey = sample(picture, _mapped(pixels_from_plane, _SQUARE_SAMPLES)).reshape(-1, len(_SPREAD)).mean(axis=1)
    if grey[_BLACK].mean() > grey[~_BLACK].mean():
        # Turned by 180 degrees: one side of the board has black ends, the other white ones.
        corners, grey = corners[::-1], grey[::-1]
        pixels_from_plane = pixels_from_plane * (-1.0, -1.0, 1.0)
    white, black = median(grey[~_BLACK].tolist()), median(grey[_BLACK].tolist())
    wrong = int(((grey < 0.5 * (white + black)) != _BLACK).sum())
    if white - black < _LEAST_CONTRAST or wrong > _MOST_WRONG_SQUARES:
        return None
    if not _has_white_rim(picture, pixels_from_plane, black + _LEAST_RIM_WHITENESS * (white - black)):
        return None
    return Find(np.ascontiguousarray(corners), white, black)


def _has_white_rim(picture: Image, pixels_from_plane: Array, least: float) -> bool:
    """Return whether the board ends where it should: colours alone would also fit a lattice shifted by a square."""
    rim = _mapped(pixels_from_plane, _RIM)
    if rim.min() < 0.0 or rim[:, 0].max() > picture.shape[1] - 1 or rim[:, 1].max() > picture.shape[0] - 1:
        return False
    return bool((np.add.reduceat(sample(picture, rim), _RIM_STARTS) / _RIM_COUNTS).min() >= least)


def sample(picture: Image, points: Array) -> Array:
    """Return grey levels (n) at points (n, 2) [px], interpolated; the border repeats outside the picture."""
    columns, rows = points.T.astype(np.float32).reshape(2, 1, -1)
    grey = cv2.remap(picture, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(grey, dtype=np.float64).ravel()


def card_outline(corners: Array) -> Array:
    """Return the four corners (4, 2) [px] of the printed card, as if the lens were straight."""
    return _mapped(homography(_GRID, corners), _CARD)


def _mapped(h: Array, points: Array) -> Array:
    lifted = points @ h[:, :2].T + h[:, 2]
    return np.asarray(lifted[:, :2] / lifted[:, 2:])


def homography(plane: Array, image: Array) -> Array:
    """Return the (3, 3) homography that maps plane points (n, 2) to image points (n, 2), least squares with h22 = 1."""
    n = len(plane)
    system = np.zeros((2 * n, 8))  # rows (x, y, 1, 0, 0, 0, -u x, -u y), then (0, 0, 0, x, y, 1, -v x, -v y)
    system[:n, :2] = system[n:, 3:5] = plane
    system[:n, 2] = system[n:, 5] = 1.0
    system[:n, 6:], system[n:, 6:] = -image[:, :1] * plane, -image[:, 1:] * plane
    h = np.ones(9)
    h[:8] = np.linalg.solve(system.T @ system, system.T @ image.T.ravel())
    return h.reshape(3, 3)
