"""Predicts sightings of markers under errors of the field's figures, many at once. Pure arrays.

A pose is (x, y, z, yaw, roll, pitch) [m, rad; world]. A fixed camera's pose is its survey with its errors.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from groundstation.arrays import Array, BoolArray
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import BASE_FROM_LEVEL_OPTICAL, rotations_from_euler, world_from_downward_optical

_STEP = 1e-5
# Errors of a detector's pose beyond its covariance: across, along per metre, heading [m, share, rad].
_FLOOR_M, _FLOOR_SHARE, _FLOOR_RAD = 0.003, 0.002, math.radians(0.5)


@dataclass(frozen=True, slots=True)
class Looks:
    """The cameras and markers of n sightings, as the field has them.

    fixed: whether the observer is fixed in the world; level (n, 3, 3): base_from_optical of a level onboard camera, or
    world_from_optical of a fixed one; tilt, pan [rad], eye (n, 3) [m; base]; marker (n, 3) [m; base of the subject].
    """

    fixed: BoolArray
    level: Array
    pan: Array
    tilt: Array
    eye: Array
    marker: Array


@dataclass(frozen=True, slots=True)
class Scene:
    """Poses of observers and subjects (n, 6), errors of mountings (n, 5: pan, tilt, ahead, left, up), print and focal.

    Each column is a channel that `slopes` differentiates by.
    """

    observer: Array
    subject: Array
    mounting: Array
    shares: Array


def looks_of(field: ResolvedField, observers: Sequence[str], subjects: Sequence[str]) -> Looks:
    """Return the looks of sightings by name."""
    fixed = np.array([name in field.cameras for name in observers], dtype=bool)
    level, angles, eye = {}, {}, {}
    for name, camera in field.cameras.items():
        level[name], angles[name], eye[name] = world_from_downward_optical(camera.rotation_deg), (0.0, 0.0), (0.0,) * 3
    for name, drone in field.drones.items():
        mount = drone.camera
        level[name], eye[name] = BASE_FROM_LEVEL_OPTICAL, mount.position_m
        angles[name] = (math.radians(mount.pan_left_deg), math.radians(mount.tilt_down_deg))
    markers = {name: drone.marker.position_m for name, drone in field.drones.items()}
    markers |= {name: (0.0, 0.0, target.marker.height_m) for name, target in field.tracked.items()}
    turned = np.array([angles[name] for name in observers]).reshape(-1, 2)
    return Looks(
        fixed,
        np.array([level[name] for name in observers]).reshape(-1, 3, 3),
        turned[:, 0],
        turned[:, 1],
        np.array([eye[name] for name in observers]).reshape(-1, 3),
        np.array([markers[name] for name in subjects]).reshape(-1, 3),
    )


def predicted(looks: Looks, scene: Scene) -> Array:
    """Return the predicted report of each marker (n, 4): centre [m; camera_optical] and heading [rad]."""
    base = rotations_from_euler(scene.observer[:, 4], scene.observer[:, 5], scene.observer[:, 3])
    pan, tilt = looks.pan + scene.mounting[:, 0], looks.tilt + scene.mounting[:, 1]
    turned = rotations_from_euler(np.zeros(len(pan)), tilt, pan)
    rotation = base @ (turned @ looks.level)
    eye = scene.observer[:, :3] + np.einsum("nij,nj->ni", base, looks.eye + scene.mounting[:, 2:])
    leaning = rotations_from_euler(scene.subject[:, 4], scene.subject[:, 5], scene.subject[:, 3])
    marker = scene.subject[:, :3] + np.einsum("nij,nj->ni", leaning, looks.marker)
    centre = np.einsum("nji,nj->ni", rotation, marker - eye)
    # A larger print looks nearer in all directions, a longer lens along the axis only.
    centre = centre / (1.0 + scene.shares[:, :1])
    centre[:, 2] /= 1.0 + scene.shares[:, 1]
    heading = scene.subject[:, 3] - scene.observer[:, 3] - scene.mounting[:, 0]
    return np.column_stack((centre, heading))


def slopes(looks: Looks, scene: Scene, here: Array) -> dict[str, Array]:
    """Return derivatives (n, 4, channels) of `predicted` by each part of a scene."""
    found = {}
    for part in fields(Scene):
        values = getattr(scene, part.name)
        table = np.empty((len(here), 4, values.shape[1]))
        for channel in range(values.shape[1]):
            moved = values.copy()
            moved[:, channel] += _STEP
            table[:, :, channel] = (predicted(looks, replace(scene, **{part.name: moved})) - here) / _STEP
        found[part.name] = table
    return found


def noise(covariance: Array, seen: Array, rates: Array, stamp_std_s: float) -> Array:
    """Return the covariance (n, 4, 4) of sightings: the detector's, its floor, and the scatter of exposure times."""
    total = covariance + stamp_std_s**2 * rates[:, :, None] * rates[:, None, :]
    far = np.linalg.norm(seen[:, :3], axis=1)
    total[:, (0, 1), (0, 1)] += _FLOOR_M**2
    total[:, 2, 2] += _FLOOR_M**2 + (_FLOOR_SHARE * far) ** 2
    total[:, 3, 3] += _FLOOR_RAD**2
    return np.asarray(total)


def off(seen: Array, here: Array) -> Array:
    """Return seen minus predicted (n, 4), headings wrapped."""
    gap = seen - here
    gap[:, 3] = np.remainder(gap[:, 3] + math.pi, math.tau) - math.pi
    return np.asarray(gap)
