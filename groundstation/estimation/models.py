"""Models per entity type behind one protocol: what a block of the state holds and the figures its kernel needs.

A new motion model is one file with its kernel, one class here, and one branch in `motion.predict`.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array
from groundstation.estimation.layout import ROBOT_CORE, TARGET_CORE, EntityKind

Vector3 = tuple[float, float, float]
CARRIER_LABELS = (*ROBOT_CORE, "roll_error", "pitch_error")


class MotionModel(Protocol):
    """How one entity moves. `number` is the kernel that predicts it, `labels` are its entries of the state."""

    number: ClassVar[int]
    kind: ClassVar[EntityKind]
    labels: ClassVar[tuple[str, ...]]

    def row(self) -> Array:
        """Return the parameters in the columns that the kernel reads (slots.py)."""


@dataclass(frozen=True, slots=True)
class OdometryRobot:
    """A vehicle driven by its own velocity and heading increments; slow errors of its sensors are states.

    velocity_scale: true speed over reported speed as calibrated, known to `scale_std` (a state follows the rest);
    velocity_std_m_s with its correlation time becomes white noise; heading wanders by yaw_std_rad per root second;
    attitude and height errors are Gauss-Markov states; climb is a Gauss-Markov state where the vehicle reports none.
    """

    number: ClassVar[int] = s.ODOMETRY_ROBOT
    kind: ClassVar[EntityKind] = EntityKind.ROBOT
    labels: ClassVar[tuple[str, ...]] = (*CARRIER_LABELS, "climb", "velocity_scale", "height_error")

    marker_position_m: Vector3 = (0.0, 0.0, 0.08)
    velocity_scale: float = 1.0
    scale_std: float = 0.10
    scale_drift: float = 0.005
    velocity_std_m_s: float = 0.05
    velocity_correlation_s: float = 0.2
    velocity_delay_s: float = 0.03
    yaw_std_rad: float = math.radians(1.0)
    attitude_std_rad: float = math.radians(1.0)
    attitude_correlation_s: float = 5.0
    height_std_m: float = 0.04
    height_correlation_s: float = 2.0
    height_delay_s: float = 0.085
    climb_std_m_s: float = 0.08
    climb_correlation_s: float = 0.7
    reports_climb: bool = False
    hold_s: float = 0.2

    def row(self) -> Array:
        """Return the parameters in the columns that the kernel reads."""
        row = np.zeros(s.PARAMETER_COLUMNS)
        row[:3] = self.marker_position_m
        row[s.VELOCITY_GAIN] = self.velocity_scale
        row[s.VELOCITY_DENSITY] = self.velocity_std_m_s**2 * self.velocity_correlation_s
        row[s.YAW_DENSITY] = self.yaw_std_rad**2
        row[s.SCALE_DENSITY], row[s.SCALE_STD] = self.scale_drift**2, self.scale_std
        row[s.CLIMB_STD], row[s.CLIMB_TAU] = self.climb_std_m_s, self.climb_correlation_s
        row[s.ATTITUDE_STD], row[s.ATTITUDE_TAU] = self.attitude_std_rad, self.attitude_correlation_s
        row[s.HEIGHT_STD], row[s.HEIGHT_TAU] = self.height_std_m, self.height_correlation_s
        # The slow part of the error is a state; what is left is quick, and alike in neighbouring samples.
        row[s.HEIGHT_VARIANCE] = (0.5 * self.height_std_m) ** 2
        row[s.HAS_CLIMB_RATE], row[s.HOLD_S] = float(self.reports_climb), self.hold_s
        return row


@dataclass(frozen=True, slots=True)
class ConstantVelocityTarget:
    """A ground vehicle of which only a marker at a known height is seen; white acceleration moves it.

    acceleration_std_m_s2 lasts for correlation_s; speed_std_m_s is what is believed before it is first seen.
    """

    number: ClassVar[int] = s.CONSTANT_VELOCITY
    kind: ClassVar[EntityKind] = EntityKind.TARGET
    labels: ClassVar[tuple[str, ...]] = TARGET_CORE

    marker_height_m: float = 0.4
    acceleration_std_m_s2: float = 0.3
    correlation_s: float = 0.12
    speed_std_m_s: float = 0.4

    def row(self) -> Array:
        """Return the parameters in the columns that the kernel reads."""
        row = np.zeros(s.PARAMETER_COLUMNS)
        row[s.MARKER_Z] = self.marker_height_m
        row[s.ACCELERATION_DENSITY] = self.acceleration_std_m_s2**2 * self.correlation_s
        row[s.SPEED_STD] = self.speed_std_m_s
        return row


@dataclass(frozen=True, slots=True)
class FixedMount:
    """Where a world-fixed camera hangs [m; world], and how well that is known.

    Its errors are the same in every picture: as states they do not average out, and what robots learn from each other
    about them is kept. Over `creep_s` the mounting may change by as much as its first uncertainty.
    """

    number: ClassVar[int] = s.FIXED_MOUNT
    kind: ClassVar[EntityKind] = EntityKind.CAMERA
    labels: ClassVar[tuple[str, ...]] = CARRIER_LABELS

    position_m: Vector3
    attitude_std_rad: float
    position_std_m: float
    creep_s: float = 3600.0

    def row(self) -> Array:
        """Return the parameters in the columns that the kernel reads."""
        row = np.zeros(s.PARAMETER_COLUMNS)
        row[s.POSITION_DRIFT] = self.position_std_m**2 / self.creep_s
        row[s.ANGLE_DRIFT] = self.attitude_std_rad**2 / self.creep_s
        return row

    def prior(self) -> tuple[Array, Array]:
        """Return mean and variances (6) of its states."""
        mean = np.array([*self.position_m, 0.0, 0.0, 0.0])
        return mean, np.array([self.position_std_m**2] * 3 + [self.attitude_std_rad**2] * 3)


@dataclass(frozen=True, slots=True)
class MountedCamera:
    """A camera on a carrier (a robot or a fixed mount): extrinsics, and how well they are known on the carrier.

    rotation (3, 3), translation (3): carrier_from_camera [m]. A mounting error is the same in every picture, so it
    enters R `repeats` times over: it must not average out.
    """

    carrier: str
    rotation: Array
    translation: Vector3 = (0.0, 0.0, 0.0)
    attitude_std_rad: float = 0.0
    position_std_m: float = 0.0
    observes_targets: bool = True
    repeats: float = 10.0

    def row(self) -> Array:
        """Return the extrinsics in the columns that the kernels read."""
        row = np.zeros(s.CAMERA_COLUMNS)
        row[s.CAMERA_ROTATION : s.CAMERA_ROTATION + 9] = np.asarray(self.rotation, dtype=np.float64).ravel()
        row[s.CAMERA_TRANSLATION : s.CAMERA_TRANSLATION + 3] = self.translation
        row[s.CAMERA_ATTITUDE_VARIANCE] = self.repeats * self.attitude_std_rad**2
        row[s.CAMERA_POSITION_VARIANCE] = self.repeats * self.position_std_m**2
        return row
