"""The shortest way round obstacles, by their corners in the floor plan. Pure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.sparse.csgraph import floyd_warshall

from groundstation.arrays import Array, BoolArray, IntMatrix
from groundstation.planning.parameters import NO_FENCE, SOFT_WALL_M
from groundstation.sensing.models import Box, Rectangle
from groundstation.vectors import Vector2

# Corners are passed at this distance beyond the one to be kept, or, in narrow passages, at the second one. A drift
# holds a robot off by up to 0.2 m, usually by 0.05 m: nearer to a corner it would stop before it.
_BESIDE_M, _NARROWLY_M = 0.1, 0.06
# A way that keeps the least distance only must be shorter by this share; at each corner it saves 0.2 m anyway.
_SHORTER = 0.25
# From here on a corner is reached. A robot may come nearer by as much on its way to a corner, or it would turn back
# wherever a narrow passage is clear from the corner alone; but not where the output limiter would stop it.
_REACHED_M = 0.05
# A way that only touches a rectangle is clear of it.
_TOUCH_M = 1e-6
# The uncertainty counts in steps: the ways between corners are computed once for each.
_STEP_M = 0.05
_MOST_SETS = 256


@dataclass(frozen=True, slots=True)
class Way:
    """A way to a goal: the point to fly to next, and its length to the end [m].

    is_straight: that point is the end: the goal, or the place nearest to it that is clear. is_known: False where no
    way was found; it is straight ahead then.
    """

    next_m: Vector2
    length_m: float
    is_straight: bool = True
    is_known: bool = True


@dataclass(frozen=True, slots=True)
class Detours:
    """Ways round obstacles.

    keep_m: distance of a robot's centre from them in plans [m]; margin_m, sigmas: the output limiter's, beyond the
    fence and the distance without plans' soft wall, in metres and standard deviations.
    """

    obstacles: tuple[Box, ...] = ()
    keep_m: float = 0.6
    fence: Rectangle = NO_FENCE
    margin_m: float = 0.15
    sigmas: float = 2.0

    @property
    def least_m(self) -> float:
        """Return the distance that the output limiter enforces for a place without doubt [m]."""
        return self.keep_m - SOFT_WALL_M + self.margin_m

    def way(self, place: Vector2, goal: Vector2, height_m: float, std_m: float = 0.0) -> Way:
        """Return the shortest way at a height; straight ahead where none is known.

        std_m: standard deviation of the place along any axis. Plans' distance is kept, or, where that leads nowhere or
        much farther, the output limiter's. A way may begin nearer to an obstacle than it goes on; a goal too near to
        one is approached as far as allowed.
        """
        if self.obstacles:
            doubt_m = _STEP_M * math.ceil(self.sigmas * std_m / _STEP_M)
            keep_m = self.least_m + doubt_m
            wide_m = max(self.keep_m, keep_m + _BESIDE_M)
            fence = self.fence.shrunk(self.margin_m + doubt_m + _NARROWLY_M)
            wide = _way(place, goal, self._outlines(height_m, wide_m), wide_m, _BESIDE_M, fence)
            if wide is not None and wide.is_straight and wide.next_m == goal:
                return wide
            # Between an obstacle and the fence only a narrow way may end near the goal.
            farther_m = self._short_m(goal, height_m, wide_m, fence) - self._short_m(goal, height_m, keep_m, fence)
            ends_near = not farther_m > wide_m - keep_m + _TOUCH_M
            if wide is not None and wide.is_straight and ends_near:
                return wide
            narrow = _way(place, goal, self._outlines(height_m, keep_m), keep_m, _NARROWLY_M, fence)
            shorter = narrow is not None and wide is not None and narrow.length_m <= (1.0 - _SHORTER) * wide.length_m
            if wide is not None and (narrow is None or (ends_near and not shorter)):
                return wide
            if narrow is not None:
                return narrow
        return Way(goal, math.dist(place, goal), is_known=not self.obstacles)

    def extra_m(self, place: Vector2, goal: Vector2, height_m: float, std_m: float = 0.0) -> float:
        """Return how much longer the way is than the straight one [m]; infinite without a way."""
        way = self.way(place, goal, height_m, std_m)
        return max(0.0, way.length_m - math.dist(place, goal)) if way.is_known else math.inf

    def clear_of(self, places: Array, height_m: float) -> BoolArray:
        """Return which places (n, 2) are far enough from all obstacles at a height."""
        clear = np.ones(len(places), dtype=np.bool_)
        for outline in self._outlines(height_m, self.keep_m):
            (x0, x1), (y0, y1) = outline.grown(self.keep_m).x_m, outline.grown(self.keep_m).y_m
            x, y = places[:, 0], places[:, 1]
            clear &= (x <= x0) | (x >= x1) | (y <= y0) | (y >= y1)
        return clear

    def _short_m(self, goal: Vector2, height_m: float, keep_m: float, fence: Rectangle) -> float:
        """Return how far from the goal a way that keeps a distance ends [m]; infinite if it ends nowhere."""
        around = [outline.grown(keep_m) for outline in self._outlines(height_m, keep_m)]
        end = _cleared(goal, around, fence)
        return math.inf if end is None else math.dist(end, goal)

    def _outlines(self, height_m: float, keep_m: float) -> tuple[Rectangle, ...]:
        return tuple(box.outline for box in self.obstacles if height_m < box.size_m[2] + keep_m)


STRAIGHT = Detours()
"""Ways without obstacles."""


def _way(
    place: Vector2, goal: Vector2, outlines: tuple[Rectangle, ...], keep_m: float, beside_m: float, fence: Rectangle
) -> Way | None:
    """Return the shortest way that keeps a distance, None if there is none."""
    around = [outline.grown(keep_m) for outline in outlines]
    end = _cleared(goal, around, fence)
    # Who is too near to an obstacle may go on beside it, and leaves it if he is inside.
    near = [_beside(outline, keep_m - (_REACHED_M if beside_m > _NARROWLY_M else 0.0), place) for outline in outlines]
    begin = _cleared(place, near, fence)
    if end is None or begin is None:
        return None
    if begin != place:
        rest = _way(begin, goal, outlines, keep_m, beside_m, fence)
        return None if rest is None else Way(begin, math.dist(place, begin) + rest.length_m, is_straight=False)
    near_rows = _rows(near)
    if _clear(np.array([place]), np.array([end]), near_rows)[0, 0]:
        return Way(end, math.dist(place, end))
    corners, lengths, before = _corner_ways(outlines, keep_m, beside_m, fence)
    if not len(corners):
        return None
    first = _lengths(np.array([place]), corners, near_rows)[0]
    whole = first[:, None] + lengths + _lengths(corners, np.array([end]), _rows(around))[:, 0]
    if not math.isfinite(length_m := float(whole.min())):
        return None
    one, last = divmod(int(whole.argmin()), len(corners))
    # Who has reached a corner goes on, else a way that is clear from the corner alone would be lost there.
    if first[one] < _REACHED_M and one == last:
        return Way(end, length_m)
    x, y = corners[before[last, one] if first[one] < _REACHED_M else one].tolist()
    return Way((x, y), length_m, is_straight=False)


def _beside(outline: Rectangle, keep_m: float, place: Vector2) -> Rectangle:
    """Return what to keep out of round an obstacle, with a place that is too near on its border."""
    return outline.grown(max(0.0, min(keep_m, -outline.depth_m(*place))))


def _cleared(point: Vector2, around: Sequence[Rectangle], fence: Rectangle) -> Vector2 | None:
    """Return the nearest point that is inside none of the rectangles; None if none is found."""
    inside = [one for one in around if one.depth_m(*point) > _TOUCH_M]
    if not inside:
        return point
    x, y = point
    sides = [side for one in inside for side in (*((at, y) for at in one.x_m), *((x, at) for at in one.y_m))]
    found = (*sides, *(corner for one in around for corner in one.corners))
    clear = [at for at in found if fence.depth_m(*at) >= 0.0 and all(one.depth_m(*at) <= _TOUCH_M for one in around)]
    return min(clear, key=lambda at: math.dist(at, point), default=None)


def _rows(rectangles: Sequence[Rectangle]) -> Array:
    """Return low x and y, high x and y of rectangles (n, 4)."""
    rows = [(*(one.x_m[0], one.y_m[0]), *(one.x_m[1], one.y_m[1])) for one in rectangles]
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def _clear(a: Array, b: Array, rows: Array) -> BoolArray:
    """Return whether the straight ways from points a (m, 2) to points b (k, 2) are outside of all rectangles (m, k)."""
    ways = (b[None] - a[:, None])[:, :, None]
    still = np.abs(ways) < _TOUCH_M
    from_low, from_high = rows[:, :2] - a[:, None, None], rows[:, 2:] - a[:, None, None]
    safe = np.where(still, 1.0, ways)
    between = (from_low <= 0.0) & (from_high >= 0.0)
    enters = np.where(still, np.where(between, -np.inf, np.inf), np.minimum(from_low / safe, from_high / safe))
    leaves = np.where(still, np.where(between, np.inf, -np.inf), np.maximum(from_low / safe, from_high / safe))
    shares = np.minimum(leaves.min(axis=3), 1.0) - np.maximum(enters.max(axis=3), 0.0)
    lengths = np.linalg.norm(ways[:, :, 0], axis=2)
    return np.asarray((np.maximum(shares, 0.0) * lengths[:, :, None] <= _TOUCH_M).all(axis=2))


def _lengths(a: Array, b: Array, rows: Array) -> Array:
    """Return the lengths of the straight ways (m, k) [m]; infinite where one is not clear."""
    return np.where(_clear(a, b, rows), np.linalg.norm(b[None] - a[:, None], axis=2), np.inf)


@lru_cache(_MOST_SETS)
def _corner_ways(
    outlines: tuple[Rectangle, ...], keep_m: float, beside_m: float, fence: Rectangle
) -> tuple[Array, Array, IntMatrix]:
    """Return the corners that a way may turn at (n, 2), and the lengths of the shortest ways between them (n, n) [m].

    Third: the number of the corner before the second one, on the way from the first (n, n).
    """
    around = [outline.grown(keep_m) for outline in outlines]
    corners = [
        corner
        for outline in outlines
        for corner in outline.grown(keep_m + beside_m).corners
        if fence.depth_m(*corner) >= 0.0 and all(one.depth_m(*corner) <= 0.0 for one in around)
    ]
    places = np.array(corners, dtype=np.float64).reshape(-1, 2)
    if not len(places):
        return places, np.empty((0, 0)), np.empty((0, 0), dtype=np.int64)
    lengths, before = floyd_warshall(_lengths(places, places, _rows(around)), return_predecessors=True)
    return places, np.asarray(lengths), np.asarray(before, dtype=np.int64)
