"""Rotation matrices `a_from_b`: v_a = a_from_b @ v_b. Euler angles are intrinsic z-y-x (yaw, pitch, roll)."""

import math
from collections.abc import Sequence

import numpy as np

from groundstation.arrays import Array


def rotation_x(angle_rad: float) -> Array:
    """Return the (3, 3) rotation about x by a right-handed angle."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rotation_y(angle_rad: float) -> Array:
    """Return the (3, 3) rotation about y by a right-handed angle."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def rotation_z(angle_rad: float) -> Array:
    """Return the (3, 3) rotation about z by a right-handed angle."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rotation_from_euler(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Array:
    """Return parent_from_body for FLU axes: roll right side down, pitch nose down, yaw counter-clockwise positive."""
    return rotation_z(yaw_rad) @ rotation_y(pitch_rad) @ rotation_x(roll_rad)


def rotations_from_euler(roll_rad: Array, pitch_rad: Array, yaw_rad: Array) -> Array:
    """Return the rotations (..., 3, 3) of angles (...), as `rotation_from_euler` does."""
    (cr, cp, cy), (sr, sp, sy) = (tuple(f(a) for a in (roll_rad, pitch_rad, yaw_rad)) for f in (np.cos, np.sin))
    rows = (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def euler_from_rotation(parent_from_body: Array) -> tuple[float, float, float]:
    """Return (roll, pitch, yaw) of a rotation matrix; pitch in [-pi/2, pi/2]."""
    r = parent_from_body
    pitch = math.asin(float(np.clip(-r[2, 0], -1.0, 1.0)))
    return math.atan2(r[2, 1], r[2, 2]), pitch, math.atan2(r[1, 0], r[0, 0])


# camera_optical: z forward, x right, y down; a camera looking along base x has base_from_optical below.
BASE_FROM_LEVEL_OPTICAL: Array = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
BASE_FROM_LEVEL_OPTICAL.setflags(write=False)

# A camera fixed in the world that looks straight down: picture right is world x, picture down is world -y.
WORLD_FROM_DOWNWARD_OPTICAL: Array = np.diag([1.0, -1.0, -1.0])
WORLD_FROM_DOWNWARD_OPTICAL.setflags(write=False)


def world_from_downward_optical(rotation_deg: Sequence[float]) -> Array:
    """Return world_from_camera_optical (3, 3) of a camera turned from looking down by (roll, pitch, yaw) [deg].

    The turn is about the world's axes, as in `rotation_from_euler`.
    """
    roll, pitch, yaw = (math.radians(angle) for angle in rotation_deg)
    return np.asarray(rotation_from_euler(roll, pitch, yaw) @ WORLD_FROM_DOWNWARD_OPTICAL)


def base_from_tilted_optical(tilt_down_rad: float, pan_rad: float = 0.0) -> Array:
    """Return base_from_camera_optical (3, 3) of a forward camera panned left and tilted down."""
    return rotation_z(pan_rad) @ rotation_y(tilt_down_rad) @ BASE_FROM_LEVEL_OPTICAL
