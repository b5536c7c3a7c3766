"""A camera on a robot or on a fixed mount measures where a marker is, and which way it points.

z = (marker centre [camera_optical], heading of the subject relative to the observer's heading). Extrinsics are
parameters: camera on its carrier, marker on the subject. The carrier's roll and pitch are as reported plus error
states.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.dispatch import LOCATE, MEASURE, PREPARE
from groundstation.estimation.kernel import address_of, kernel
from groundstation.estimation.linear import wrap
from groundstation.estimation.models.protocol import Vector3
from groundstation.estimation.models.subject import chain_subject, marker_offset, marker_point

# Rotation (9) and translation (3) carrier_from_camera, mounting variances.
ROTATION = s.FIRST_SENSOR_OWN
TRANSLATION, ATTITUDE_VARIANCE, POSITION_VARIANCE = ROTATION + 9, ROTATION + 12, ROTATION + 13


@kernel("void(float64[::1], int64[::1], float64[::1], float64[::1])", inlined=True)
def observer_angles(mean: Array, entity: IntArray, event: Array, out: Array) -> None:
    """Write (cos, sin) of yaw, of pitch and of roll, the latter two as reported plus the error state."""
    start = entity[s.ENTITY_START]
    roll, pitch = event[s.EVENT_ROLL], event[s.EVENT_PITCH]
    if entity[s.AT_ROLL_ERROR] >= 0:
        roll += mean[start + entity[s.AT_ROLL_ERROR]]
        pitch += mean[start + entity[s.AT_PITCH_ERROR]]
    angles = (mean[start + s.YAW], pitch, roll)
    for i in range(3):
        out[2 * i] = math.cos(angles[i])
        out[2 * i + 1] = math.sin(angles[i])


@kernel("void(float64[::1], float64[::1], float64[:,::1], float64[::1])", inlined=True)
def point_in_base(d: Array, cs: Array, D: Array, b: Array) -> None:
    """Rotate d [world's axes] into [base], with the derivatives D (3, 6) by d, yaw, pitch, roll."""
    cy, sy, cp, sp, cr, sr = cs[0], cs[1], cs[2], cs[3], cs[4], cs[5]
    ex, ey, ez = cy * d[0] + sy * d[1], -sy * d[0] + cy * d[1], d[2]
    fx, fz = cp * ex - sp * ez, sp * ex + cp * ez
    b[0], b[1], b[2] = fx, cr * ey + sr * fz, -sr * ey + cr * fz
    D[0, 0], D[0, 1], D[0, 2] = cp * cy, cp * sy, -sp
    D[1, 0], D[1, 1], D[1, 2] = sr * sp * cy - cr * sy, sr * sp * sy + cr * cy, sr * cp
    D[2, 0], D[2, 1], D[2, 2] = cr * sp * cy + sr * sy, cr * sp * sy - sr * cy, cr * cp
    D[0, 3], D[1, 3], D[2, 3] = cp * ey, -cr * ex + sr * sp * ey, sr * ex + cr * sp * ey
    D[0, 4], D[1, 4], D[2, 4] = -fz, sr * fx, cr * fx
    D[0, 5], D[1, 5], D[2, 5] = 0.0, b[2], -b[1]


@kernel(MEASURE)
def measure_relative_pose(
    mean: Array, entities: IntArray, parameters: Array, sensor: Array, event: Array, rows: int, h: Array,
    H_observer: Array, H_subject: Array,
) -> None:  # fmt: skip
    """Write h(x) and its Jacobians by the observer's and the subject's block."""
    observer, subject = entities[int(event[s.EVENT_OBSERVER])], entities[int(event[s.EVENT_SUBJECT])]
    work, cs, D = np.empty((5, 3)), np.empty(6), np.empty((3, 6))
    point, slope, d, b, by_point = work[0], work[1], work[2], work[3], work[4]
    marker_point(mean, subject, parameters[int(event[s.EVENT_SUBJECT])], event, point, slope)
    observer_angles(mean, observer, event, cs)
    for i in range(3):
        d[i] = point[i] - mean[observer[s.ENTITY_START] + i]
    point_in_base(d, cs, D, b)
    for i in range(3):
        by_angle_0 = by_angle_1 = by_angle_2 = 0.0
        h[i] = by_point[0] = by_point[1] = by_point[2] = 0.0
        for k in range(3):
            c = sensor[ROTATION + 3 * k + i]
            h[i] += c * (b[k] - sensor[TRANSLATION + k])
            for j in range(3):
                by_point[j] += c * D[k, j]
            by_angle_0 += c * D[k, 3]
            by_angle_1 += c * D[k, 4]
            by_angle_2 += c * D[k, 5]
        for j in range(3):
            H_observer[i, j] = -by_point[j]
        H_observer[i, s.YAW] = by_angle_0
        if observer[s.AT_ROLL_ERROR] >= 0:
            H_observer[i, observer[s.AT_PITCH_ERROR]] = by_angle_1
            H_observer[i, observer[s.AT_ROLL_ERROR]] = by_angle_2
        chain_subject(subject, slope, by_point, H_subject, i)
    if rows == 4:
        yaw = subject[s.AT_YAW]
        h[3] = wrap(mean[subject[s.ENTITY_START] + yaw] - mean[observer[s.ENTITY_START] + s.YAW])
        H_observer[3, s.YAW] = -1.0
        H_subject[3, yaw] = 1.0


@kernel(PREPARE)
def prepare_relative_pose(
    entities: IntArray, parameters: Array, sensor: Array, event: Array, z: Array, R: Array
) -> int:
    """Add the uncertainty of the camera's mounting to R: a turn moves a point at z sideways, a shift moves it as is."""
    if z[2] <= 0.0:
        return -s.OUT_OF_VIEW
    rows = 4 if event[s.EVENT_SIZE] > 3.0 and entities[int(event[s.EVENT_SUBJECT]), s.AT_YAW] >= 0 else 3
    turn, shift = sensor[ATTITUDE_VARIANCE], sensor[POSITION_VARIANCE]
    square = z[0] * z[0] + z[1] * z[1] + z[2] * z[2]
    for i in range(3):
        R[i, i] += turn * square + shift
        for j in range(3):
            R[i, j] -= turn * z[i] * z[j]
    if rows == 4:
        R[3, 3] += turn
    return rows


@kernel(LOCATE)
def locate_relative_pose(
    mean: Array, entities: IntArray, parameters: Array, sensor: Array, event: Array, z: Array, pose: Array
) -> int:
    """Write the subject's (x, y, z, yaw) [world] that would produce the measurement without noise."""
    subject = int(event[s.EVENT_SUBJECT])
    observer = entities[int(event[s.EVENT_OBSERVER])]
    start = observer[s.ENTITY_START]
    cs, b, offset = np.empty(6), np.empty(3), np.empty(3)
    observer_angles(mean, observer, event, cs)
    for k in range(3):
        b[k] = sensor[TRANSLATION + k]
        for i in range(3):
            b[k] += sensor[ROTATION + 3 * k + i] * z[i]
    cp, sp, cr, sr = cs[2], cs[3], cs[4], cs[5]
    fy, fz = cr * b[1] - sr * b[2], sr * b[1] + cr * b[2]
    ex, ez = cp * b[0] + sp * fz, -sp * b[0] + cp * fz
    yaw = wrap(mean[start + s.YAW] + z[3])
    marker_offset(entities[subject], parameters[subject], event, yaw, offset)
    pose[0] = mean[start] + cs[0] * ex - cs[1] * fy - offset[0]
    pose[1] = mean[start + 1] + cs[1] * ex + cs[0] * fy - offset[1]
    pose[2] = mean[start + 2] + ez - offset[2]
    pose[3] = yaw
    return 1


@dataclass(frozen=True, slots=True)
class MountedCamera:
    """A camera on a carrier (a robot or a fixed mount): extrinsics, and how well they are known on the carrier.

    rotation (3, 3), translation (3): carrier_from_camera [m]. A mounting error is the same in every picture, so it
    enters R `repeats` times over: it must not average out. stamp_std_s: of the time of exposure about the calibrated
    delay; while observer or subject moves it displaces what is seen.
    """

    kernels: ClassVar[tuple[int, int, int]] = (
        address_of(measure_relative_pose),
        address_of(prepare_relative_pose),
        address_of(locate_relative_pose),
    )
    angles: ClassVar[tuple[int, ...]] = (3,)

    carrier: str
    rotation: Array
    translation: Vector3 = (0.0, 0.0, 0.0)
    attitude_std_rad: float = 0.0
    position_std_m: float = 0.0
    observes_targets: bool = True
    repeats: float = 10.0
    stamp_std_s: float = 0.0
    repeats_s: float = 0.0

    def row(self) -> Array:
        """Return the extrinsics in the columns that the kernels read."""
        row = np.zeros(s.SENSOR_COLUMNS)
        row[ROTATION : ROTATION + 9] = np.asarray(self.rotation, dtype=np.float64).ravel()
        row[TRANSLATION : TRANSLATION + 3] = self.translation
        row[ATTITUDE_VARIANCE] = self.repeats * self.attitude_std_rad**2
        row[s.SENSOR_TIME_VARIANCE] = self.stamp_std_s**2
        row[POSITION_VARIANCE] = self.repeats * self.position_std_m**2
        return row
