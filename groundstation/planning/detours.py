"""The shortest way round obstacles, by their corners in the floor plan. Pure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations

import numpy as np
from scipy.sparse.csgraph import floyd_warshall

from groundstation.arrays import Array, BoolArray
from groundstation.field.resolved import ResolvedField
from groundstation.planning.parameters import NO_FENCE, parameters_from_field
from groundstation.sensing.from_field import boxes_from_field
from groundstation.sensing.models import Box, Rectangle
from groundstation.vectors import Vector2

# Corners are passed at this distance beyond the one to be kept: from beside one the way behind it must be clear.
_BESIDE_M = 0.1
_REACHED_M = 0.05
# A way that only touches a rectangle is clear of it.
_TOUCH_M = 1e-6
_MOST_SETS = 64


@dataclass(frozen=True, slots=True)
class Way:
    """A way to a goal: the point to fly to next, its length to the end [m], and whether that point is the goal."""

    next_m: Vector2
    length_m: float
    is_straight: bool = True


@dataclass(frozen=True, slots=True)
class Detours:
    """Ways round obstacles, at the distance keep_m of a robot's centre from them [m], and inside a fence."""

    obstacles: tuple[Box, ...] = ()
    keep_m: float = 0.6
    fence: Rectangle = NO_FENCE

    def way(self, place: Vector2, goal: Vector2, height_m: float) -> Way:
        """Return the shortest way at a height; straight ahead where none is known.

        A place or goal nearer to an obstacle than `keep_m` is left, or reached, on the side on which it is.
        """
        straight = Way(goal, math.dist(place, goal))
        if not self.obstacles:
            return straight
        outlines = self._outlines(height_m)
        around = [_around(outline, self.keep_m, place, goal) for outline in outlines]
        if _is_clear(place, goal, around):
            return straight
        corners, lengths = _corner_ways(outlines, self.keep_m, self.fence)
        first = np.array([_length_m(place, corner, around) for corner in corners])
        first[first < _REACHED_M] = math.inf
        last = np.array([_length_m(corner, goal, around) for corner in corners])
        whole = first[:, None] + lengths + last[None, :]
        if not (whole.size and math.isfinite(whole.min())):
            return straight
        begin = int(whole.argmin()) // len(corners)
        return Way(corners[begin], float(whole.min()), is_straight=False)

    def extra_m(self, place: Vector2, goal: Vector2, height_m: float) -> float:
        """Return how much longer the way is than the straight one [m]."""
        return self.way(place, goal, height_m).length_m - math.dist(place, goal)

    def clear_of(self, places: Array, height_m: float) -> BoolArray:
        """Return which places (n, 2) are far enough from all obstacles at a height."""
        clear = np.ones(len(places), dtype=np.bool_)
        for outline in self._outlines(height_m):
            (x0, x1), (y0, y1) = outline.grown(self.keep_m).x_m, outline.grown(self.keep_m).y_m
            x, y = places[:, 0], places[:, 1]
            clear &= (x <= x0) | (x >= x1) | (y <= y0) | (y >= y1)
        return clear

    def _outlines(self, height_m: float) -> tuple[Rectangle, ...]:
        return tuple(box.outline for box in self.obstacles if height_m < box.size_m[2] + self.keep_m)


STRAIGHT = Detours()
"""Ways without obstacles."""


def detours_from_field(field: ResolvedField) -> Detours:
    """Return the ways of a resolved field: as far from obstacles as plans are."""
    planner = parameters_from_field(field)
    return Detours(boxes_from_field(field), planner.obstacle_m, planner.fence)


def _around(outline: Rectangle, keep_m: float, *points: Vector2) -> Rectangle:
    """Return what to keep out of round an obstacle, none of the points inside."""
    return outline.grown(max(0.0, min(keep_m, *(-outline.depth_m(*point) for point in points))))


def _is_clear(a: Vector2, b: Vector2, rectangles: Sequence[Rectangle]) -> bool:
    """Return whether the straight way between two points is outside of all rectangles."""
    length = math.dist(a, b)
    if length < _TOUCH_M:
        return True
    way = (b[0] - a[0]) / length, (b[1] - a[1]) / length
    spans = (rectangle.span(a, way) for rectangle in rectangles)
    return all(min(last, length) - max(first, 0.0) <= _TOUCH_M for first, last in spans)


def _length_m(a: Vector2, b: Vector2, rectangles: Sequence[Rectangle]) -> float:
    return math.dist(a, b) if _is_clear(a, b, rectangles) else math.inf


@lru_cache(_MOST_SETS)
def _corner_ways(outlines: tuple[Rectangle, ...], keep_m: float, fence: Rectangle) -> tuple[tuple[Vector2, ...], Array]:
    """Return the corners that a way may turn at, and the lengths of the shortest ways between them (n, n) [m]."""
    around = [outline.grown(keep_m) for outline in outlines]
    corners = tuple(
        corner
        for outline in outlines
        for corner in outline.grown(keep_m + _BESIDE_M).corners
        if fence.depth_m(*corner) >= 0.0 and all(one.depth_m(*corner) <= 0.0 for one in around)
    )
    lengths = np.full((len(corners), len(corners)), np.inf)
    np.fill_diagonal(lengths, 0.0)
    for i, j in combinations(range(len(corners)), 2):
        lengths[i, j] = lengths[j, i] = _length_m(corners[i], corners[j], around)
    return corners, np.asarray(floyd_warshall(lengths)) if len(corners) else lengths
