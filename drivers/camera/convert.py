"""Conversions: from mounting and attitudes to `Gravity`, and from a sighting to a `RelativeObservation`."""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from drivers.camera.pose import LEVEL_STD_RAD, RelativePose
from drivers.camera.settings import MountSettings
from drivers.camera.sighting import Sighting
from groundstation.arrays import Array
from groundstation.bus.messages import Header, PoseHypothesis, RelativeObservation
from groundstation.geometry.rotations import (
    base_from_tilted_optical,
    rotation_from_euler,
    world_from_downward_optical,
)
from groundstation.time_units import NS_PER_MS


@lru_cache(maxsize=16)
def parent_from_optical(mount: MountSettings) -> Array:
    """Return base_from_camera_optical (3, 3) on a robot, world_from_camera_optical in the world."""
    if mount.in_world:
        rotation = world_from_downward_optical(mount.rotation_deg)
    else:
        rotation = base_from_tilted_optical(math.radians(mount.tilt_down_deg), math.radians(mount.pan_deg))
    rotation.setflags(write=False)
    return rotation


def stabilized_from_optical(mount: MountSettings, roll_rad: float, pitch_rad: float) -> Array:
    """Return base_stabilized_from_camera_optical of a carrier with that attitude.

    That of the world for a fixed camera.
    """
    if mount.in_world:
        return parent_from_optical(mount)
    return np.asarray(rotation_from_euler(roll_rad, pitch_rad, 0.0) @ parent_from_optical(mount))


def observation_from_sighting(
    sighting: Sighting,
    header: Header,
    camera: str,
    mount: MountSettings,
    attitude: tuple[float, float] | None,
    picture_ns: int = 0,
) -> RelativeObservation:
    """Return the message for a sighting; header.entity is the observer, header.stamp_ns the exposure.

    attitude: of the observer; None: unknown, so it is assumed to be level, with a wide deviation; picture_ns: as in the
    message.
    """
    best, other = sighting.choice.best, sighting.choice.alternative
    if attitude is None:
        best, other = _assumed_level(best, mount), other and _assumed_level(other, mount)
    roll_rad, pitch_rad = attitude or (0.0, 0.0)
    return RelativeObservation(
        header=header,
        observer=header.entity,
        subject=sighting.entity,
        camera=camera,
        position_m=_vector(best),
        yaw_rad=best.yaw_rad,
        covariance=tuple(best.covariance.ravel().tolist()),
        alternative=None
        if other is None
        else PoseHypothesis(_vector(other), other.yaw_rad, tuple(other.covariance.ravel().tolist())),
        margin=sighting.margin,
        roll_rad=roll_rad,
        pitch_rad=pitch_rad,
        picture_ns=picture_ns,
    )


def _assumed_level(pose: RelativePose, mount: MountSettings) -> RelativePose:
    """Return a pose whose observer was assumed to be level; of a level marker's heading that changes nothing."""
    level = stabilized_from_optical(mount, 0.0, 0.0)
    x, y, z = (level @ pose.position_m).tolist()
    by_tilt = level.T @ np.array([[0.0, z], [-z, 0.0], [y, -x]])
    covariance = pose.covariance.copy()
    covariance[:3, :3] += LEVEL_STD_RAD**2 * (by_tilt @ by_tilt.T)
    return replace(pose, covariance=covariance)


def row_ns(corners: Array, height_px: int, readout_ms: float) -> int:
    """Return how much later than its picture's middle row a marker was exposed [ns]; corners (n, 2) [px]."""
    return round((float(corners[:, 1].mean()) / height_px - 0.5) * readout_ms * NS_PER_MS)


def _vector(pose: RelativePose) -> tuple[float, float, float]:
    x, y, z = pose.position_m.tolist()
    return x, y, z
