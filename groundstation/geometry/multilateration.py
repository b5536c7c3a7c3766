"""Locates a transponder by its ranges to anchors at known places alone."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array
from groundstation.vectors import Interval, Vector3

_LEAST_RANGES = 4
_STEPS, _SETTLED_M = 12, 1e-4
# A residual beyond this many deviations means a reflection: the ranges together then yield no place.
_MOST_SIGMAS = 3.5


@dataclass(frozen=True, slots=True)
class Fix:
    """A position [m; world] and its covariance (3, 3)."""

    position_m: Vector3
    covariance: Array


def fix_from_ranges(
    anchors_m: Sequence[Vector3], ranges_m: Sequence[float], std_m: float, about_m: Vector3, about_std_m: Vector3
) -> Fix | None:
    """Return the position that fits ranges to anchors best, in the least squares of Gauss and Newton.

    anchors_m [m; world], ranges_m [m], std_m of each; about_m, about_std_m: a priori place of the transponder: it
    decides between a place and its mirror image behind a plane of anchors. None: fewer than four ranges, or ranges that
    contradict the others.
    """
    if len(ranges_m) < _LEAST_RANGES:
        return None
    places, told, first = np.array(anchors_m), np.array(ranges_m), np.array(about_m)
    prior = 1.0 / np.array(about_std_m) ** 2
    point = first.copy()
    for _ in range(_STEPS):
        away = point - places
        lengths = np.maximum(np.sqrt((away**2).sum(axis=1)), 1e-3)
        H = away / lengths[:, None]
        information = H.T @ H / std_m**2 + np.diag(prior)
        step = np.linalg.solve(information, H.T @ (told - lengths) / std_m**2 + prior * (first - point))
        point = point + step
        if float(np.abs(step).max()) < _SETTLED_M:
            break
    else:
        return None
    residuals = told - np.sqrt(((point - places) ** 2).sum(axis=1))
    if float(np.abs(residuals).max()) > _MOST_SIGMAS * std_m:
        return None
    x, y, z = point.tolist()
    return Fix((x, y, z), np.linalg.inv(information))


def likely_in(volume_m: tuple[Interval, Interval, Interval]) -> tuple[Vector3, Vector3]:
    """Return the a priori place of a transponder in a box or a little outside, with its deviation [m; world]."""
    x, y, z = (sum(span) / 2 for span in volume_m)
    wide, deep, high = (max(1.0, span[1] - span[0]) for span in volume_m)
    return (x, y, z), (wide, deep, high / 2)


def horizontal_std_m(anchors_m: Sequence[Vector3], point_m: Vector3, std_m: float, height_std_m: float) -> float:
    """Return the larger standard deviation in the plane [m] that one range to each anchor leaves at a point.

    height_std_m: deviation of the height without them. Infinite if they do not determine a place.
    """
    away = np.array(point_m) - np.array(anchors_m).reshape(-1, 3)
    H = away / np.maximum(np.sqrt((away**2).sum(axis=1)), 1e-3)[:, None]
    information = H.T @ H / std_m**2
    information[2, 2] += 1.0 / height_std_m**2
    if np.linalg.cond(information) > 1e9:
        return math.inf
    return math.sqrt(float(np.linalg.eigvalsh(np.linalg.inv(information)[:2, :2])[1]))
