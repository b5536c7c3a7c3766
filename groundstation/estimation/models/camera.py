"""A camera on a robot or a fixed mount: measures a marker's place and heading.

z = (marker centre [camera_optical], heading of the subject relative to the observer's heading). Extrinsics are
parameters: camera on its carrier, marker on the subject. The carrier's roll and pitch are as reported plus error
states.
"""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from groundstation.arrays import Array, Matrix, Vector
from groundstation.estimation.filter_state import Belief
from groundstation.estimation.linear import wrap
from groundstation.estimation.model_kernels import SensorKernels
from groundstation.estimation.models.protocol import SensorDefaults, Vector3
from groundstation.estimation.models.subject import chain_subject, marker_offset, marker_point
from groundstation.estimation.records import (
    OUT_OF_VIEW,
    YAW,
    EntityRow,
    EventRow,
    Prediction,
    SensorRow,
    X,
    Y,
    Z,
    own_parameters,
)
from groundstation.kernel import Record, kernel

BY_YAW, BY_PITCH, BY_ROLL = 3, 4, 5  # columns of derivatives after those by x, y, z


class CameraParameters(Record):
    """carrier_from_camera [m], and the variances of its mounting [rad^2, m^2]; sees_all_round: 1 without a lens."""

    rotation: Annotated[Array, (3, 3)]
    translation: Annotated[Array, (3,)]
    attitude_variance: float
    position_variance: float
    sees_all_round: int


_own = own_parameters(CameraParameters)


class Attitude(NamedTuple):
    """Cosines and sines of yaw, pitch and roll."""

    cos_yaw: float
    sin_yaw: float
    cos_pitch: float
    sin_pitch: float
    cos_roll: float
    sin_roll: float


@kernel(inlined=True)
def observer_attitude(mean: Vector, entity: EntityRow, event: EventRow) -> Attitude:
    """Return the observer's attitude: roll and pitch as reported plus the error states."""
    start, roll, pitch = entity.start, event.roll, event.pitch
    if entity.at_roll_error >= 0:
        roll += mean[start + entity.at_roll_error]
        pitch += mean[start + entity.at_pitch_error]
    yaw = mean[start + YAW]
    return Attitude(math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch), math.cos(roll), math.sin(roll))


@kernel(inlined=True)
def point_in_base(d: Vector, attitude: Attitude, D: Matrix, b: Vector) -> None:
    """Rotate d [world's axes] into [base], with the derivatives D (3, 6) by d, yaw, pitch, roll."""
    cy, sy, cp, sp, cr, sr = attitude
    ex, ey, ez = cy * d[X] + sy * d[Y], -sy * d[X] + cy * d[Y], d[Z]
    fx, fz = cp * ex - sp * ez, sp * ex + cp * ez
    b[X], b[Y], b[Z] = fx, cr * ey + sr * fz, -sr * ey + cr * fz
    D[X, X], D[X, Y], D[X, Z] = cp * cy, cp * sy, -sp
    D[Y, X], D[Y, Y], D[Y, Z] = sr * sp * cy - cr * sy, sr * sp * sy + cr * cy, sr * cp
    D[Z, X], D[Z, Y], D[Z, Z] = cr * sp * cy + sr * sy, cr * sp * sy - sr * cy, cr * cp
    D[X, BY_YAW], D[Y, BY_YAW], D[Z, BY_YAW] = cp * ey, -cr * ex + sr * sp * ey, sr * ex + cr * sp * ey
    D[X, BY_PITCH], D[Y, BY_PITCH], D[Z, BY_PITCH] = -fz, sr * fx, cr * fx
    D[X, BY_ROLL], D[Y, BY_ROLL], D[Z, BY_ROLL] = 0.0, b[Z], -b[Y]


@kernel()
def measure_relative_pose(belief: Belief, sensor: SensorRow, event: EventRow, out: Prediction) -> None:
    """Write h(x) and its Jacobians by the observer's and the subject's block."""
    mean, observer, subject = belief.mean, belief.entities[event.observer], belief.entities[event.subject]
    p, h, H_observer, H_subject = _own(sensor), out.h, out.H_observer, out.H_subject
    work, D = np.empty((7, 3)), np.empty((3, 6))
    point, d, b, by_point, slopes = work[0], work[1], work[2], work[3], work[4:]
    marker_point(belief, event, point, slopes)
    for i in range(3):
        d[i] = point[i] - mean[observer.start + i]
    point_in_base(d, observer_attitude(mean, observer, event), D, b)
    for i in range(3):
        by_yaw = by_pitch = by_roll = 0.0
        h[i] = by_point[X] = by_point[Y] = by_point[Z] = 0.0
        for k in range(3):
            c = p.rotation[k, i]
            h[i] += c * (b[k] - p.translation[k])
            for j in range(3):
                by_point[j] += c * D[k, j]
            by_yaw += c * D[k, BY_YAW]
            by_pitch += c * D[k, BY_PITCH]
            by_roll += c * D[k, BY_ROLL]
        for j in range(3):
            H_observer[i, j] = -by_point[j]
        H_observer[i, YAW] = by_yaw
        if observer.at_roll_error >= 0:
            H_observer[i, observer.at_pitch_error] = by_pitch
            H_observer[i, observer.at_roll_error] = by_roll
        chain_subject(subject, slopes, by_point, H_subject, i)
    if out.size > YAW:
        h[YAW] = wrap(mean[subject.start + subject.at_yaw] - mean[observer.start + YAW])
        H_observer[YAW, YAW] = -1.0
        H_subject[YAW, subject.at_yaw] = 1.0


@kernel()
def prepare_relative_pose(belief: Belief, sensor: SensorRow, event: EventRow, z: Vector, R: Matrix) -> int:
    """Add the camera mounting's uncertainty to R: a rotation moves a point at z sideways, a shift directly.

    Return the number of rows that count, or minus OUT_OF_VIEW.
    """
    if z[Z] <= 0.0 and _own(sensor).sees_all_round == 0:
        return -OUT_OF_VIEW
    rows = 4 if event.size > 3 and belief.entities[event.subject].at_yaw >= 0 else 3
    turn, shift = _own(sensor).attitude_variance, _own(sensor).position_variance
    square = z[X] * z[X] + z[Y] * z[Y] + z[Z] * z[Z]
    for i in range(3):
        R[i, i] += turn * square + shift
        for j in range(3):
            R[i, j] -= turn * z[i] * z[j]
    if rows == 4:
        R[YAW, YAW] += turn
    return rows


@kernel()
def locate_relative_pose(belief: Belief, sensor: SensorRow, event: EventRow, z: Vector, pose: Vector) -> bool:
    """Write the subject's (x, y, z, yaw) [world] that would produce the measurement without noise."""
    mean, observer, p = belief.mean, belief.entities[event.observer], _own(sensor)
    start, b, offset = observer.start, np.empty(3), np.empty(3)
    cy, sy, cp, sp, cr, sr = observer_attitude(mean, observer, event)
    for k in range(3):
        b[k] = p.translation[k]
        for i in range(3):
            b[k] += p.rotation[k, i] * z[i]
    fy, fz = cr * b[Y] - sr * b[Z], sr * b[Y] + cr * b[Z]
    ex, ez = cp * b[X] + sp * fz, -sp * b[X] + cp * fz
    yaw = wrap(mean[start + YAW] + z[YAW])
    marker_offset(mean, belief.entities[event.subject], event, yaw, offset)
    pose[X] = mean[start + X] + cy * ex - sy * fy - offset[X]
    pose[Y] = mean[start + Y] + sy * ex + cy * fy - offset[Y]
    pose[Z] = mean[start + Z] + ez - offset[Z]
    pose[YAW] = yaw
    return True


@dataclass(frozen=True, slots=True)
class MountedCamera(SensorDefaults):
    """A camera on a carrier (a robot or a fixed mount): extrinsics and their uncertainty.

    rotation (3, 3), translation (3): carrier_from_camera [m]. A mounting error is the same in every picture, so it
    enters R `repeats` times: it must not average out. stamp_std_s: of the exposure time about the calibrated delay; it
    displaces sightings while observer or subject moves. sees_all_round: it has no lens, and nothing is behind it.
    """

    kernels: ClassVar[SensorKernels] = SensorKernels(measure_relative_pose, prepare_relative_pose, locate_relative_pose)
    angles = (YAW,)

    carrier: str
    rotation: Array
    translation: Vector3 = (0.0, 0.0, 0.0)
    attitude_std_rad: float = 0.0
    position_std_m: float = 0.0
    observes_targets: bool = True
    repeats: float = 10.0
    stamp_std_s: float = 0.0
    repeats_s: float = 0.0
    sees_all_round: bool = False

    def own(self) -> CameraParameters:
        """Return the parameters that the kernels read."""
        return CameraParameters.row(
            rotation=self.rotation,
            translation=self.translation,
            attitude_variance=self.repeats * self.attitude_std_rad**2,
            position_variance=self.repeats * self.position_std_m**2,
            sees_all_round=int(self.sees_all_round),
        )
