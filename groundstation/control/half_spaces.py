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
    the same smallest sufficient amount, but not beyond most = 0: zero satisfies all in the end.
    """
    velocity, met = _nearest(wanted, normals, most)
    if velocity is not None:
        return velocity, met
    least, enough = 0.0, max(0.0, -float(most.min()))
    found, _ = _nearest(wanted, normals, np.maximum(most, 0.0))
    for _ in range(_HALVINGS):
        middle = 0.5 * (least + enough)
        velocity, _ = _nearest(wanted, normals, np.where(most < 0.0, np.minimum(most + middle, 0.0), most))
        if velocity is None:
            least = middle
        else:
            enough, found = middle, velocity
    return np.zeros(3) if found is None else found, met


def _nearest(wanted: Array, normals: Array, most: Array) -> tuple[Array | None, list[int]]:
    """Return the nearest velocity, or None if no velocity is allowed."""
    velocity, basis, met = wanted, tuple[Plane, ...](), list[int]()
    x, y, z = wanted.tolist()
    for _ in range(_EXCHANGES):
        excess = normals @ velocity - most
        worst = int(excess.argmax())
        if excess[worst] <= TOLERANCE_M_S:
            return velocity, met
        met.append(worst)
        a, b, c = normals[worst].tolist()
        corner = _corner((x, y, z), (*basis, ((a, b, c), float(most[worst]))))
        if corner is None:
            return None, met
        velocity, basis = np.array(corner[0]), corner[1]
    return None, met


def _corner(wanted: Vector3, asked: tuple[Plane, ...]) -> tuple[Vector3, tuple[Plane, ...]] | None:
    """Return the nearest velocity on the border of the last half-space that all allow, and those that touch it."""
    for size in range(min(3, len(asked))):
        for others in combinations(asked[:-1], size):
            touched = (*others, asked[-1])
            velocity = touching(wanted, touched)
            if velocity and all(dot(normal, velocity) - most <= TOLERANCE_M_S for normal, most in asked):
                return velocity, touched
    return None
