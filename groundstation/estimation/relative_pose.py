"""Observation model: a camera on a robot or on a fixed mount measures where a marker is, and which way it points.

z = (marker centre [camera_optical], heading of the subject relative to the observer's heading). Extrinsics are
parameters: camera on its carrier, marker on the subject.
"""

import math

import numpy as np

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array
from groundstation.estimation.kernel import kernel
from groundstation.estimation.linear import wrap


@kernel("void(float64[::1], float64, float64, float64[::1])")
def observer_angles(observer: Array, roll: float, pitch: float, out: Array) -> None:
    """Write (cos, sin) of yaw, of pitch and of roll, the latter two as reported plus the error state."""
    angles = (observer[s.YAW], pitch + observer[s.PITCH_ERROR], roll + observer[s.ROLL_ERROR])
    for i in range(3):
        out[2 * i] = math.cos(angles[i])
        out[2 * i + 1] = math.sin(angles[i])


@kernel("void(float64[::1], float64[::1])")
def stabilize(cs: Array, v: Array) -> None:
    """Rotate v [base] to [base_stabilized] in place."""
    cp, sp, cr, sr = cs[2], cs[3], cs[4], cs[5]
    bx, by, bz = v[0], v[1], v[2]
    fy, fz = cr * by - sr * bz, sr * by + cr * bz
    v[0], v[1], v[2] = cp * bx + sp * fz, fy, -sp * bx + cp * fz


@kernel("void(float64[::1], float64[::1], int64, float64[::1], float64[::1])")
def marker_point(subject: Array, p: Array, model: int, point: Array, slope: Array) -> None:
    """Write the marker's centre [world] and its derivative by the subject's yaw (zero for targets)."""
    slope[0] = slope[1] = 0.0
    if model == s.ODOMETRY_ROBOT:
        c, n = math.cos(subject[s.YAW]), math.sin(subject[s.YAW])
        dx, dy = c * p[0] - n * p[1], n * p[0] + c * p[1]
        point[0], point[1], point[2] = subject[0] + dx, subject[1] + dy, subject[2] + p[2]
        slope[0], slope[1] = -dy, dx
    else:
        point[0], point[1], point[2] = subject[0], subject[1], p[2]


@kernel(
    "void(float64[::1], float64[::1], float64[::1], int64, float64[::1], float64, float64, int64,"
    " float64[::1], float64[:,::1], float64[:,::1])"
)
def relative_pose(
    observer: Array,
    subject: Array,
    p: Array,
    model: int,
    camera: Array,
    roll: float,
    pitch: float,
    rows: int,
    h: Array,
    H_observer: Array,
    H_subject: Array,
) -> None:
    """Write h(x) (4) and its Jacobians by observer and subject block (4, MAX_BLOCK)."""
    work = np.empty((6, 3))
    cs = np.empty(6)
    point, slope, e, f, b = work[0], work[1], work[2], work[3], work[4]
    marker_point(subject, p, model, point, slope)
    observer_angles(observer, roll, pitch, cs)
    cy, sy, cp, sp, cr, sr = cs[0], cs[1], cs[2], cs[3], cs[4], cs[5]
    dx, dy, dz = point[0] - observer[0], point[1] - observer[1], point[2] - observer[2]
    e[0], e[1], e[2] = cy * dx + sy * dy, -sy * dx + cy * dy, dz
    f[0], f[1], f[2] = cp * e[0] - sp * e[2], e[1], sp * e[0] + cp * e[2]
    b[0], b[1], b[2] = f[0], cr * f[1] + sr * f[2], -sr * f[1] + cr * f[2]
    D = np.zeros((3, 8))  # columns: by the point (3), yaw, pitch, roll of the observer, yaw of the subject
    D[0, 0], D[0, 1], D[0, 2] = cp * cy, cp * sy, -sp
    D[1, 0], D[1, 1], D[1, 2] = sr * sp * cy - cr * sy, sr * sp * sy + cr * cy, sr * cp
    D[2, 0], D[2, 1], D[2, 2] = cr * sp * cy + sr * sy, cr * sp * sy - sr * cy, cr * cp
    gz = sp * e[1]
    D[0, 3], D[1, 3], D[2, 3] = cp * e[1], -cr * e[0] + sr * gz, sr * e[0] + cr * gz
    D[0, 4], D[1, 4], D[2, 4] = -f[2], sr * f[0], cr * f[0]
    D[0, 5], D[1, 5], D[2, 5] = 0.0, b[2], -b[1]
    for i in range(3):
        D[i, 6] = D[i, 0] * slope[0] + D[i, 1] * slope[1]
    for i in range(4):
        for j in range(s.MAX_BLOCK):
            H_observer[i, j] = H_subject[i, j] = 0.0
    for i in range(3):
        h[i] = 0.0
        for k in range(3):
            c = camera[s.CAMERA_ROTATION + 3 * k + i]
            h[i] += c * (b[k] - camera[s.CAMERA_TRANSLATION + k])
            for j in range(3):
                H_subject[i, j] += c * D[k, j]
            H_observer[i, s.YAW] += c * D[k, 3]
            H_observer[i, s.PITCH_ERROR] += c * D[k, 4]
            H_observer[i, s.ROLL_ERROR] += c * D[k, 5]
            H_subject[i, s.YAW] += c * D[k, 6]
        for j in range(3):
            H_observer[i, j] = -H_subject[i, j]
    if model != s.ODOMETRY_ROBOT:
        for i in range(3):
            H_subject[i, s.Z] = H_subject[i, s.YAW] = 0.0
    if rows == 4:
        h[3] = wrap(subject[s.YAW] - observer[s.YAW])
        H_observer[3, s.YAW] = -1.0
        H_subject[3, s.YAW] = 1.0


@kernel("void(float64[::1], float64[::1], int64, float64[::1], float64, float64, float64[::1], float64[::1])")
def pose_from_observation(
    observer: Array, p: Array, model: int, camera: Array, roll: float, pitch: float, z: Array, pose: Array
) -> None:
    """Write the subject's (x, y, z, yaw) [world] that would produce the measurement without noise."""
    cs = np.empty(6)
    b = np.empty(3)
    observer_angles(observer, roll, pitch, cs)
    for k in range(3):
        b[k] = camera[s.CAMERA_TRANSLATION + k]
        for i in range(3):
            b[k] += camera[s.CAMERA_ROTATION + 3 * k + i] * z[i]
    stabilize(cs, b)
    yaw = wrap(observer[s.YAW] + z[3])
    c, n = 0.0, 0.0
    if model == s.ODOMETRY_ROBOT:
        c, n = math.cos(yaw), math.sin(yaw)
    pose[0] = observer[0] + cs[0] * b[0] - cs[1] * b[1] - (c * p[0] - n * p[1])
    pose[1] = observer[1] + cs[1] * b[0] + cs[0] * b[1] - (n * p[0] + c * p[1])
    pose[2] = observer[2] + b[2] - p[2]
    pose[3] = yaw


@kernel("void(float64[::1], float64[::1], int64, float64[:,::1])")
def add_mounting_noise(camera: Array, z: Array, rows: int, R: Array) -> None:
    """Add the uncertainty of the camera's mounting to R: a turn moves a point at z sideways, a shift moves it as is."""
    turn, shift = camera[s.CAMERA_ATTITUDE_VARIANCE], camera[s.CAMERA_POSITION_VARIANCE]
    square = z[0] * z[0] + z[1] * z[1] + z[2] * z[2]
    for i in range(3):
        R[i, i] += turn * square + shift
        for j in range(3):
            R[i, j] -= turn * z[i] * z[j]
    if rows == 4:
        R[3, 3] += turn
