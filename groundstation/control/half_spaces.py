"""The velocity nearest to a wanted one that some half-spaces allow. Pure.

Exact: a point of R^3 is fixed by three of them at most, so that a basis of the violated ones is exchanged until nothing
is violated (Sharir and Welzl's scheme for problems of low dimension).
"""

from itertools import combinations

import numpy as np

from groundstation.arrays import Array

TOLERANCE_M_S = 1e-7
_EXCHANGES = 40
_HALVINGS = 8
_PARALLEL = 1e-12


def project(wanted: Array, normals: Array, most: Array) -> tuple[Array, list[int]]:
    """Return the nearest velocity v with normals @ v <= most, and which half-spaces were met on the way.

    normals: unit rows [m, 3]. Where no velocity satisfies all, those that ask for motion (most < 0) ask for less, all
    by the same amount, as little as it takes, and none for less than to stand: zero satisfies all in the end.
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
    """Return the nearest velocity, or None where there is none."""
    velocity, basis, met = wanted, tuple[int, ...](), list[int]()
    for _ in range(_EXCHANGES):
        excess = normals @ velocity - most
        worst = int(np.argmax(excess))
        if excess[worst] <= TOLERANCE_M_S:
            return velocity, met
        met.append(worst)
        corner = _corner(wanted, normals, most, basis, worst)
        if corner is None:
            return None, met
        velocity, basis = corner
    return None, met


def _corner(
    wanted: Array, normals: Array, most: Array, basis: tuple[int, ...], worst: int
) -> tuple[Array, tuple[int, ...]] | None:
    """Return the nearest velocity that the basis and one more half-space allow, and those that it touches."""
    asked = [*basis, worst]
    for size in range(min(3, len(asked))):
        for others in combinations(basis, size):
            touched = (*others, worst)
            N, b = normals[list(touched)], most[list(touched)]
            gram = N @ N.T
            if size and float(np.linalg.det(gram)) < _PARALLEL:
                continue
            pull = np.linalg.solve(gram, N @ wanted - b)
            velocity = wanted - N.T @ pull
            if pull.min() >= 0.0 and (normals[asked] @ velocity - most[asked]).max() <= TOLERANCE_M_S:
                return velocity, touched
    return None
