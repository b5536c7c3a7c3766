"""Converts rigid bodies in the system's axes to entities in the world's."""

import math
from dataclasses import dataclass
from numbers import Real

import numpy as np

from drivers.motion_capture.settings import BodySection, MotionCaptureSection
from drivers.motion_capture.wire.ros2_pose import UNKNOWN, Deviations
from groundstation.arrays import Array
from groundstation.bus.messages import BodyPose, Header, RelativeObservation
from groundstation.geometry.angles import quaternion_from_euler
from groundstation.geometry.rotations import euler_from_rotation, rotation_z
from groundstation.vectors import Quaternion, Vector3

# No volume is this large; beyond it, sums of jumps lose a body's motion to rounding, and products overflow.
_FARTHEST_M = 1e4


@dataclass(frozen=True, slots=True)
class EntityPose:
    """An entity's pose: centre [m; world], world_from_base (3, 3), centre of its marker [m; world].

    deviations: as the system reports them, in its axes; exposure_ns: when it was there.
    """

    position: Vector3
    rotation: Array
    marker: Vector3
    deviations: Deviations = UNKNOWN
    exposure_ns: int = 0


class Placement:
    """Turns the poses of one system's bodies into those of the entities that carry them."""

    def __init__(self, settings: MotionCaptureSection) -> None:
        self._rotation, self._translation = settings.world_from_system()
        self._upright = settings.upright()
        self._name, self._settings, self._covariance = settings.name, settings, settings.covariance()

    def entity_pose(
        self, body: BodySection, position: Vector3, quaternion: Quaternion, deviations: Deviations = UNKNOWN
    ) -> EntityPose | None:
        """Return the pose of the entity that carries a body; None if the numbers are no pose.

        position [m], quaternion (x, y, z, w): of the body, in the system's axes.
        """
        if len(position) != 3 or len(quaternion) != 4 or not all(map(_is_finite, (*position, *quaternion))):
            return None
        length = math.sqrt(sum(value * value for value in quaternion))
        if not 0.5 < length < 2.0 or not all(abs(value) < _FARTHEST_M for value in position):
            return None
        system_from_body = _rotation_of(quaternion, length)
        # WIRE (docs/reference/natnet.md 5): a body's axes are the system's at the moment of its definition, so the
        # rotation that sets the system upright sets the body upright.
        world_from_body = self._rotation @ system_from_body @ self._upright.T
        world_from_base = world_from_body @ rotation_z(math.radians(body.yaw_deg)).T
        origin = self._rotation @ np.array(position) + self._translation
        centre = origin - world_from_base @ np.array(body.position_m)
        marker = centre + world_from_base @ np.array(body.marker_m)
        return EntityPose(_triple(centre), world_from_base, _triple(marker), deviations)

    def observation(self, entity: str, pose: EntityPose, header: Header) -> RelativeObservation:
        """Return the observation of an entity for the tracker."""
        return RelativeObservation(
            header=header,
            observer=self._name,
            subject=entity,
            camera=self._name,
            position_m=pose.marker,
            yaw_rad=euler_from_rotation(pose.rotation)[2],
            covariance=self._covariance_of(pose.deviations),
            margin=2.0,
        )

    def _covariance_of(self, deviations: Deviations) -> tuple[float, ...]:
        """Return the covariance (4, 4) of place [world] and heading: the configured one, or a larger reported one."""
        least = (*[self._settings.position_std_m] * 3, math.radians(self._settings.heading_std_deg))
        if all(told <= known for told, known in zip(deviations, least, strict=True)):
            return self._covariance
        *place, heading = (max(pair) ** 2 for pair in zip(deviations, least, strict=True))
        covariance = np.zeros((4, 4))
        turned = self._rotation @ np.diag(place) @ self._rotation.T
        covariance[:3, :3], covariance[3, 3] = 0.5 * (turned + turned.T), heading
        return tuple(covariance.ravel().tolist())


def body_pose(entity: str, pose: EntityPose) -> BodyPose:
    """Return an entity's pose as a message."""
    return BodyPose(entity, pose.position, _quaternion_of(pose.rotation))


def _is_finite(value: object) -> bool:
    """Return whether something, which may be of another package, is a finite number."""
    try:
        return isinstance(value, Real) and math.isfinite(value)
    except OverflowError:  # an integer beyond all floats
        return False


def _triple(vector: Array) -> Vector3:
    x, y, z = vector.tolist()
    return x, y, z


def _rotation_of(quaternion: Quaternion, length: float) -> Array:
    x, y, z, w = (value / length for value in quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _quaternion_of(rotation: Array) -> Quaternion:
    """Return (w, x, y, z) of a rotation (3, 3), w not negative."""
    w, x, y, z = quaternion_from_euler(*euler_from_rotation(rotation))
    return (w, x, y, z) if w >= 0 else (-w, -x, -y, -z)
