"""The axis-parallel rectangle of a horizontal plane that a view pyramid shows, however it is tilted and turned."""

import math
from collections.abc import Sequence
from functools import lru_cache

from groundstation.vectors import Interval

_PARALLEL = 1e-9  # smaller slopes count as none
_SLACK = 1.0 + 1e-9  # of a border, for rounding
_KEPT = 256  # results: robots on one height ask for the same
Border = tuple[float, float, float]
"""(x, y, most): a place is inside if its coordinates times x and y add up to no more than most [m]."""


@lru_cache(maxsize=_KEPT)
def shown_rectangle(
    rotation: tuple[tuple[float, ...], ...], tans: tuple[float, float], border_m: float, reach_m: float, depth_m: float
) -> tuple[Interval, Interval] | None:
    """Return the intervals of x and y from the place under an eye, of a plane this far below it; None if it shows none.

    rotation: optical from world; tans: of half width and half height; border_m: distance kept from the side planes;
    reach_m: greatest distance from the eye. The rectangle lies in the view as a whole, about the middle of that part of
    the view which is in line with the eye and the optical axis, and is the largest one about it.
    """
    if reach_m <= depth_m or depth_m <= 0.0:
        return None
    borders, radius_m = _borders(rotation, tans, border_m, depth_m), math.sqrt(reach_m**2 - depth_m**2)
    middle = _middle(borders, rotation[2], radius_m)
    if middle is None:
        return None
    x, y = middle
    across, along = _half_sides([(abs(a), abs(b), most - a * x - b * y) for a, b, most in borders])
    share = _within(abs(x), abs(y), across, along, radius_m)
    across, along = share * across, share * along
    return (x - across, x + across), (y - along, y + along)


def _borders(
    rotation: Sequence[Sequence[float]], tans: tuple[float, float], border_m: float, depth_m: float
) -> list[Border]:
    """Return where the four side planes, moved inwards, cut the plane."""
    borders, ahead = [], rotation[2]
    for tan, side in zip(tans, rotation[:2], strict=True):
        for sign in (1.0, -1.0):
            x, y, up = (sign * s - tan * a for s, a in zip(side, ahead, strict=True))
            borders.append((x, y, up * depth_m - border_m * math.hypot(1.0, tan)))
    return borders


def _middle(borders: Sequence[Border], ahead: Sequence[float], radius_m: float) -> tuple[float, float] | None:
    """Return the middle of what is in view on the line from under the eye to where the optical axis points."""
    size = math.hypot(ahead[0], ahead[1])
    x, y = (ahead[0] / size, ahead[1] / size) if size > _PARALLEL else (1.0, 0.0)
    near, far = -radius_m, radius_m
    for a, b, most in borders:
        slope = a * x + b * y
        if slope > _PARALLEL:
            far = min(far, most / slope)
        elif slope < -_PARALLEL:
            near = max(near, most / slope)
        elif most <= 0.0:
            return None
    return (0.5 * (near + far) * x, 0.5 * (near + far) * y) if near < far else None


def _half_sides(limits: Sequence[Border]) -> tuple[float, float]:
    """Return the half sides of the largest rectangle about a middle; limits: borders from there, slopes not below 0.

    Its corner touches one border in the middle between the axes, or two borders where they meet.
    """
    touching = [(0.5 * most / a, 0.5 * most / b) for a, b, most in limits if min(a, b) > _PARALLEL]
    for i, (a, b, most) in enumerate(limits):
        for c, d, other in limits[:i]:
            if abs(det := a * d - b * c) > _PARALLEL:
                touching.append(((most * d - other * b) / det, (other * a - most * c) / det))
    inside = [
        (p, q) for p, q in touching if min(p, q) > 0.0 and all(a * p + b * q <= most * _SLACK for a, b, most in limits)
    ]
    return max(inside, key=lambda sides: sides[0] * sides[1], default=(0.0, 0.0))


def _within(x: float, y: float, across: float, along: float, radius_m: float) -> float:
    """Return by how much to shrink a rectangle about (x, y) for its farthest corner to be within a radius."""
    if math.hypot(x + across, y + along) <= radius_m:
        return 1.0
    square, half = across**2 + along**2, x * across + y * along
    return (math.sqrt(max(0.0, half**2 + square * (radius_m**2 - x * x - y * y))) - half) / square
