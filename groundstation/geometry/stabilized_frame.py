"""Gravity, and velocities between the world and a robot's upright, yaw-only frame."""

import math

import numpy as np

from groundstation.arrays import Array

STANDARD_GRAVITY_M_S2 = 9.80665  # also the unit of accelerometers that measure in g; local gravity differs by 0.3 %


def world_from_stabilized(velocity: Array, yaw_rad: float) -> Array:
    """Return a base_stabilized velocity (3) in the world."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array([c * velocity[0] - s * velocity[1], s * velocity[0] + c * velocity[1], velocity[2]])


def stabilized_from_world(velocity: Array, yaw_rad: float) -> Array:
    """Return a world velocity (3) in base_stabilized."""
    return world_from_stabilized(velocity, -yaw_rad)
