"""Finds the one rotation of a fixed camera that explains the displacements of all its sightings. Pure.

A camera that turns by an angle a about an axis n displaces a point that it saw at p to q, with q - p = (p + q) x g and
g = n tan(a / 2) (Cayley), in its own old axes: linear in g, however far it turns. Detection noise and the uncertainty
of the subjects are the same for all sightings, so least squares suffice.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Matrix, Vector

# Deviation between two sightings of an unmoved drone [m]; share of a displacement that may stay unexplained.
_SIGHT_M, _SHARE = 0.04, 0.25
# A priori deviation about each axis [rad]. It decides if one sighting leaves an axis open.
_LIKELY_RAD = math.radians(20.0)


@dataclass(frozen=True, slots=True)
class Displacement:
    """One camera's sighting of one robot, and the expected one [m; camera_optical]."""

    robot: str
    expected_m: Vector
    seen_m: Vector

    @property
    def size_m(self) -> float:
        """Return the distance between both [m]."""
        return float(np.linalg.norm(self.seen_m - self.expected_m))


@dataclass(frozen=True, slots=True)
class CameraTurn:
    """The turn of a camera with its deviation [rad]; the largest displacement of a sighting by it [m].

    since_s: until then what it saw was in place.
    """

    camera: str
    angle_rad: float
    std_rad: float
    displaced_m: float
    since_s: float


def camera_turn(camera: str, displaced: Sequence[Displacement], since_s: float) -> CameraTurn | None:
    """Return the rotation that explains all displacements of one camera since a time, or None if none does."""
    most_m = max(one.size_m for one in displaced)
    A = np.vstack([_cross(one.expected_m + one.seen_m) for one in displaced])
    b = np.concatenate([one.seen_m - one.expected_m for one in displaced])
    information = A.T @ A / _SIGHT_M**2 + np.eye(3) / math.tan(_LIKELY_RAD / 2.0) ** 2
    gibbs = np.linalg.solve(information, A.T @ b / _SIGHT_M**2)
    left = np.linalg.norm((b - A @ gibbs).reshape(-1, 3), axis=1)
    if float(left.max()) > _SIGHT_M + _SHARE * most_m:
        return None
    length = float(np.linalg.norm(gibbs))
    along = gibbs / max(length, 1e-9)
    std_rad = 2.0 * math.sqrt(float(along @ np.linalg.solve(information, along)))
    return CameraTurn(camera, 2.0 * math.atan(length), std_rad, most_m, since_s)


def _cross(p: Vector) -> Matrix:
    """Return the matrix of g -> p x g."""
    return np.array([[0.0, -p[2], p[1]], [p[2], 0.0, -p[0]], [-p[1], p[0], 0.0]])
