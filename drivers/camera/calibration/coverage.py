"""Coverage of the kept views, and views still missing: regions, distances, tilts. Pure."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.camera.calibration.pattern import Pattern
from drivers.camera.calibration.view_quality import KeptView
from groundstation.arrays import Array

_ROWS, _COLUMNS = ("top", "middle", "bottom"), ("left", "centre", "right")
# The outer regions are narrower: the lens is least certain where it bends most.
_EDGES = (0.28, 0.72)
_VIEWS_PER_REGION = 2
_NEAR_SHARE, _FAR_SHARE = 0.4, 0.25
_TILTED_RAD = math.radians(15.0)
TILTS = ("left side nearer", "right side nearer", "top nearer", "bottom nearer")


@dataclass(frozen=True, slots=True)
class Coverage:
    """The views in each region of the picture (3, 3), and the names of all that is missing."""

    regions: NDArray[np.int64]
    missing_regions: tuple[str, ...]
    missing_distances: tuple[str, ...]
    missing_tilts: tuple[str, ...]

    @property
    def missing(self) -> tuple[str, ...]:
        """Return all that is missing, in words."""
        regions = tuple(f"board {name} of the picture" for name in self.missing_regions)
        return (*regions, *self.missing_distances, *self.missing_tilts)


def coverage_of(views: list[KeptView], pattern: Pattern, size: tuple[int, int]) -> Coverage:
    """Return the coverage of a board's views in pictures of (width, height)."""
    regions = np.zeros((3, 3), dtype=np.int64)
    shares: list[float] = []
    tilts: set[str] = set()
    for view in views:
        columns, rows = (np.digitize(view.corners[:, k] / size[k], _EDGES) for k in range(2))
        for cell in set(zip(rows.tolist(), columns.tolist(), strict=True)):
            regions[cell] += 1
        shares.append(share_of_picture(view.corners, size))
        tilts |= tilts_of(view.corners, pattern, size)
    thin = [(r, c) for r in range(3) for c in range(3) if regions[r, c] < _VIEWS_PER_REGION]
    distances = []
    if max(shares, default=0.0) < _NEAR_SHARE:
        distances.append("near (board as wide as half the picture)")
    if min(shares, default=1.0) > _FAR_SHARE:
        distances.append("far (board as wide as a quarter of the picture)")
    names = tuple(region_name(r, c) for r, c in thin)
    return Coverage(regions, names, tuple(distances), tuple(tilt for tilt in TILTS if tilt not in tilts))


def region_name(row: int, column: int) -> str:
    """Return the name of a region, such as `top left`."""
    return "centre" if (row, column) == (1, 1) else f"{_ROWS[row]} {_COLUMNS[column]}"


def share_of_picture(corners: Array, size: tuple[int, int]) -> float:
    """Return the side of a square as large as the board, relative to one as large as the picture."""
    hull = cv2.convexHull(corners.astype(np.float32).reshape(-1, 1, 2))
    return math.sqrt(cv2.contourArea(hull) / (size[0] * size[1]))


def tilts_of(corners: Array, pattern: Pattern, size: tuple[int, int]) -> set[str]:
    """Return the directions in which a board leans, judged with a lens of 53 degrees: directions need no better one."""
    matrix = np.array([[size[0], 0.0, size[0] / 2], [0.0, size[0], size[1] / 2], [0.0, 0.0, 1.0]])
    found, turn, _ = cv2.solvePnP(pattern.points, corners.reshape(-1, 1, 2), matrix, None, flags=cv2.SOLVEPNP_IPPE)
    if not found:
        return set()
    normal = np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64)[:, 2]
    normal = normal if normal[2] < 0.0 else -normal
    least = math.sin(_TILTED_RAD)
    leaning = (normal[0] > least, normal[0] < -least, normal[1] > least, normal[1] < -least)
    return {name for name, leans in zip(TILTS, leaning, strict=True) if leans}
