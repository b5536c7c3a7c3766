"""The velocity that is nearest to a wanted one and satisfies a set of half-spaces. Pure.

Exact: at most three half-spaces fix a point of R^3, so a basis of the violated ones is exchanged until none is violated
(Sharir and Welzl's scheme for problems of low dimension).
"""

from itertools import combinations

import numpy as np

from groundstation.arrays import Array
from groundstation.control.touching import Plane, touching
from groundstation.vectors import Vector3, dot

TOLERANCE_M_S = 1e-7
_EXCHANGES = 40
_HALVINGS = 8


def project(wanted: Array, normals: Array, most: Array) -> tuple[Array, list[int]]:
    """Return the nearest velocity v with normals @ v <= most, and the half-spaces that limited it on the way.

    normals: unit rows [m, 3]. Where no velocity satisfies all, those that demand motion (most < 0) are relaxed, all by
    the same smallest sufficient amount, but not beyond most = 0: zero satisfies all in the end. Where it
    is enough to relax the half-spaces that conflict with each other, only these are relaxed.
    """
    velocity, met, conflict = _nearest(wanted, normals, most)
    if velocity is not None:
        return velocity, met
    common, relaxed = _relaxed(wanted, normals, most)
    bounds, part = most.copy(), _pushing_part(normals, most, conflict)
    bounds[part] = relaxed[part]
    # The others may push on, against a drift towards one wall while two others are too near to each other.
    found = None if (bounds == relaxed).all() else _nearest(wanted, normals, bounds)[0]
    return (common if found is None else found), met


def _relaxed(wanted: Array, normals: Array, most: Array) -> tuple[Array, Array]:
    """Return the nearest velocity if all that demand motion are relaxed by the same amount, and their bounds then."""
    least, enough = 0.0, max(0.0, -float(most.min()))
    bounds = np.maximum(most, 0.0)
    found = _nearest(wanted, normals, bounds)[0]
    for _ in range(_HALVINGS):
        middle = 0.5 * (least + enough)
        fewer = np.where(most < 0.0, np.minimum(most + middle, 0.0), most)
        velocity = _nearest(wanted, normals, fewer)[0]
        if velocity is None:
            least = middle
        else:
            enough, found, bounds = middle, velocity, fewer
    return np.zeros(3) if found is None else found, bounds


def _pushing_part(normals: Array, most: Array, conflict: list[int]) -> list[int]:
    """Return those that demand motion, without which the rest of a conflict could be satisfied."""
    pushing = [one for one in conflict if most[one] < 0.0]
    if len(pushing) < 2:
        return pushing
    needed = conflict
    for one in pushing:
        others = [other for other in needed if other != one]
        if _nearest(np.zeros(3), normals[others], most[others])[0] is None:
            needed = others
    return [one for one in needed if most[one] < 0.0]


def _nearest(wanted: Array, normals: Array, most: Array) -> tuple[Array | None, list[int], list[int]]:
    """Return the nearest velocity or None, the half-spaces met on the way, and up to four of them that conflict."""
    velocity, basis, met = wanted, tuple[Plane, ...](), list[int]()
    x, y, z = wanted.tolist()
    numbers: dict[Plane, int] = {}
    for _ in range(_EXCHANGES):
        excess = normals @ velocity - most
        worst = int(excess.argmax())
        if excess[worst] <= TOLERANCE_M_S:
            return velocity, met, []
        met.append(worst)
        a, b, c = normals[worst].tolist()
        plane = (a, b, c), float(most[worst])
        numbers[plane] = worst
        corner = _corner((x, y, z), (*basis, plane))
        if corner is None:
            return None, met, [numbers[one] for one in (*basis, plane)]
        velocity, basis = np.array(corner[0]), corner[1]
    return None, met, list(dict.fromkeys(met))


def _corner(wanted: Vector3, asked: tuple[Plane, ...]) -> tuple[Vector3, tuple[Plane, ...]] | None:
    """Return the nearest velocity on the border of the last half-space that all allow, and those that touch it."""
    for size in range(min(3, len(asked))):
        for others in combinations(asked[:-1], size):
            touched = (*others, asked[-1])
            velocity = touching(wanted, touched)
            if velocity and all(dot(normal, velocity) - most <= TOLERANCE_M_S for normal, most in asked):
                return velocity, touched
    return None
