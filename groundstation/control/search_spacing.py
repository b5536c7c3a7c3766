"""Stands far enough apart for the separation limit not to push robots away from them."""

import math
from collections.abc import Collection, Mapping
from dataclasses import replace
from itertools import combinations

from groundstation.control.stand import Stand
from groundstation.sensing.models import Rectangle

Point = tuple[float, float]

_RING = 64  # directions in which another stand is passed
_OWN_SHARE = 0.1  # of the way that a robot would have to fly: of two equal stands it takes the nearer one
_ROUNDING_M = 1e-9


def apart(
    wanted: Mapping[str, Stand],
    places: Mapping[str, Point],
    views: Mapping[str, Rectangle | None],
    distance_m: float,
) -> dict[str, Stand]:
    """Return the stands, each moved as little as needed for any two to be at least a distance apart.

    The first keeps its own, the others give way in order. places: of the robots [m; world]; views: in which each stand
    must lie, None: anywhere. In views too small for that distance, stands are as far apart as the corners allow.
    """
    points: dict[str, Point] = {}
    for name, stand in wanted.items():
        points[name] = _free_point((stand.x, stand.y), places[name], points.values(), views[name], distance_m)
    if _least_m(points) < distance_m - _ROUNDING_M:
        points = max(points, _in_corners(points, views), key=_least_m)
    return {name: replace(stand, x=points[name][0], y=points[name][1]) for name, stand in wanted.items()}


def _free_point(
    wanted: Point, place: Point, taken: Collection[Point], view: Rectangle | None, distance_m: float
) -> Point:
    """Return the point nearest to the wanted one that is far enough from the taken ones, else the farthest one."""
    options = [wanted, *(point for other in taken for point in _ring(other, wanted, distance_m))]
    if view is not None:
        options = [point for point in options if math.dist(view.nearest(*point), point) <= _ROUNDING_M]
        options += view.corners
    free = [point for point in options if _gap_m(point, taken) >= distance_m - _ROUNDING_M]
    if not free:
        return max(options, key=lambda point: _gap_m(point, taken))
    return min(free, key=lambda point: math.dist(point, wanted) + _OWN_SHARE * math.dist(point, place))


def _ring(centre: Point, towards: Point, radius_m: float) -> list[Point]:
    """Return points on a circle, the first of them towards a point."""
    first = math.atan2(towards[1] - centre[1], towards[0] - centre[0])
    angles = (first + math.tau * k / _RING for k in range(_RING))
    return [(centre[0] + radius_m * math.cos(angle), centre[1] + radius_m * math.sin(angle)) for angle in angles]


def _in_corners(points: Mapping[str, Point], views: Mapping[str, Rectangle | None]) -> dict[str, Point]:
    """Return corners of the views: first the nearest to the first point, then always the farthest from the others."""
    chosen: dict[str, Point] = {}
    for name, point in points.items():
        view = views[name]
        corners = (point,) if view is None else view.corners
        if chosen:
            chosen[name] = max(corners, key=lambda corner: _gap_m(corner, chosen.values()))
        else:
            chosen[name] = min(corners, key=lambda corner: math.dist(corner, point))
    return chosen


def _gap_m(point: Point, others: Collection[Point]) -> float:
    return min((math.dist(point, other) for other in others), default=math.inf)


def _least_m(points: Mapping[str, Point]) -> float:
    return min((math.dist(a, b) for a, b in combinations(points.values(), 2)), default=math.inf)
