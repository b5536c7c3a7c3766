"""The turn of a camera that somebody bumped into."""

import math

import numpy as np

from groundstation.arrays import Array


def turned_about(angle_deg: float, axis_deg: float) -> Array:
    """Return old_optical_from_new_optical (3, 3) for a turn about an axis in the image plane.

    axis_deg: counter-clockwise in the image from its right; 0 tilts the camera up for a positive angle.
    """
    angle, at = math.radians(angle_deg), math.radians(axis_deg)
    x, y = math.cos(at), -math.sin(at)
    cross = np.array([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross)
