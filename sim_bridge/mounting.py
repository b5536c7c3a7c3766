"""True mountings and lenses of cameras, a little off the field file like real ones; mountings after a bump."""

import math
from dataclasses import replace

import numpy as np

from groundstation.arrays import Array
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.rotations import base_from_tilted_optical, rotation_from_euler, world_from_downward_optical
from sim_bridge.site import EmulatedCamera, Lens, SiteCamera, SiteCapture
from sim_bridge.world.noise import generator_of


def generator_of_eye(seed: int, name: str) -> np.random.Generator:
    """Return a camera's random generator; study and SITL both draw mounting, then lens first, and get the same."""
    return generator_of(seed, f"{name}/eye")


def mounted(camera: SiteCamera, errors: bool, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return world_from_optical (3, 3) and position [m; world] of a camera; errors: off by its deviations."""
    turn, shift = math.radians(camera.attitude_std_deg), camera.position_std_m
    error, off = turn * rng.standard_normal(3), shift * rng.standard_normal(3)
    known, place = world_from_downward_optical(camera.rotation_deg), np.array(camera.position_m, dtype=np.float64)
    return (rotation_from_euler(*error) @ known, place + off) if errors else (known, place)


def on_drone(camera: EmulatedCamera, errors: bool, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return base_from_optical (3, 3) and position [m; base] of a drone's camera; errors: off by its deviations."""
    known, place = told_on_drone(camera), np.array(camera.position_m, dtype=np.float64)
    turn, shift = math.radians(camera.attitude_std_deg), camera.position_std_m
    if not errors or (turn == 0.0 and shift == 0.0):
        return known, place
    error, off = turn * rng.standard_normal(3), shift * rng.standard_normal(3)
    return rotation_from_euler(*error) @ known, place + off


def told_on_drone(camera: EmulatedCamera) -> Array:
    """Return base_from_optical (3, 3) of a drone's camera by the field."""
    return base_from_tilted_optical(math.radians(camera.tilt_down_deg), math.radians(camera.pan_left_deg))


def true_lens(told: Lens, errors: bool, rng: np.random.Generator) -> CameraIntrinsics:
    """Return a camera's lens; errors: off the field's figures by their deviations."""
    lens, std = told.intrinsics, told.std
    if not errors or std is None:
        return lens
    known = np.array((lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, *lens.distortion))
    fx, fy, cx, cy, *distortion = rng.normal(known, tuple(std.model_dump().values())).tolist()
    return replace(lens, fx_px=fx, fy_px=fy, cx_px=cx, cy_px=cy, distortion=tuple(distortion))


def as_measured(point: Array, true: CameraIntrinsics, told: CameraIntrinsics) -> Array:
    """Return a marker's place (3) [m; optical] as a detector computes it with the lens `told`, that of the field."""
    if true == told:
        return point
    across = told.normalised_from_pixels(true.project(point))
    depth = float(point[2]) * math.sqrt(told.fx_px * told.fy_px / (true.fx_px * true.fy_px))
    return np.array([across[0] * depth, across[1] * depth, depth])


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
