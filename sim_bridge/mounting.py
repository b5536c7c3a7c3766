"""The true place of what is fixed in the room: a little off the field file, like a real one; a camera after a bump."""

import math

import numpy as np

from groundstation.arrays import Array
from groundstation.geometry.rotations import rotation_from_euler, world_from_downward_optical
from sim_bridge.site import SiteCamera, SiteCapture
from sim_bridge.world.noise import generator_of


def generator_of_eye(seed: int, name: str) -> np.random.Generator:
    """Return a camera's random generator: it draws the mounting first, so study and SITL have the same."""
    return generator_of(seed, f"{name}/eye")


def mounted(camera: SiteCamera, errors: bool, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return world_from_optical (3, 3) and position [m; world] of a camera, off by its deviations if it has errors."""
    turn, shift = math.radians(camera.attitude_std_deg), camera.position_std_m
    error, off = turn * rng.standard_normal(3), shift * rng.standard_normal(3)
    known, place = world_from_downward_optical(camera.rotation_deg), np.array(camera.position_m, dtype=np.float64)
    return (rotation_from_euler(*error) @ known, place + off) if errors else (known, place)


def surveyed(system: SiteCapture, errors: bool, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return rotation (3, 3) and origin [m; world] of the axes that a motion capture system takes for the world's."""
    error = math.radians(system.attitude_std_deg) * rng.standard_normal(3)
    off = system.position_std_m * rng.standard_normal(3)
    return (rotation_from_euler(*error), off) if errors else (np.eye(3), np.zeros(3))


def turned_about(angle_deg: float, axis_deg: float) -> Array:
    """Return old_optical_from_new_optical (3, 3) for a turn about an axis in the image plane.

    axis_deg: counter-clockwise in the image from its right; 0 tilts the camera up for a positive angle.
    """
    angle, at = math.radians(angle_deg), math.radians(axis_deg)
    x, y = math.cos(at), -math.sin(at)
    cross = np.array([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross)
