"""Compiled rollout of the joint covariance under held controls: the value, and a tape for the adjoint.

Arrays that describe one topology's problem (built by problem.py):
poses (n, 4) x, y, z, yaw; targets (k, 4) x, y, vx, vy; heights (h, n) predicted z; prior (d, d);
edges (m, 3) camera row, observer (-1: fixed in the world), subject (robots first, then targets);
cameras (c, ROW); markers (n + k) heights above the robot's centre or above the floor; options: see OPTIONS.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from groundstation.planning.covariance import correct, predict
from groundstation.sensing.visibility import observe

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

OPTIONS = (
    "step_s",
    "discount",
    "robot_position_noise",  # [m^2/s]
    "robot_yaw_noise",  # [rad^2/s]
    "target_acceleration_noise",  # [m^2/s^3]
    "repulsion_weight",
    "separation_m",
    "fence_weight",
    "fence_x0",
    "fence_x1",
    "fence_y0",
    "fence_y1",
    "effort_weight",
    "robot_weight",
)
TARGET_WEIGHTS = len(OPTIONS)
"""From here on the options hold one weight per target, in state order."""

# Columns of a tape's edge entry: w, v and their derivatives by the relative position and by the observer's yaw.
W, W_X, W_Y, W_YAW, V, V_X, V_Y, V_YAW, RELATIVE_X, RELATIVE_Y = range(10)


@njit(
    "void(float64[::1], float64[:,::1], float64, float64[:,::1], float64[:,::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def move(u: Array, before: Array, dt: float, after: Array, motion: Array) -> None:
    """Advance (x, y, yaw) of all robots by held body velocities; motion = (displacement x, y, direction)."""
    for r in range(before.shape[0]):
        yaw = before[r, 2] + 0.5 * dt * u[3 * r + 2]
        c, s = math.cos(yaw), math.sin(yaw)
        motion[r, 0] = dt * (c * u[3 * r] - s * u[3 * r + 1])
        motion[r, 1] = dt * (s * u[3 * r] + c * u[3 * r + 1])
        motion[r, 2] = yaw
        after[r, 0] = before[r, 0] + motion[r, 0]
        after[r, 1] = before[r, 1] + motion[r, 1]
        after[r, 2] = before[r, 2] + dt * u[3 * r + 2]


@njit(
    "void(float64[::1], int64, float64, float64, float64, float64, float64[::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def look(camera: Array, onboard: int, x: float, y: float, z: float, yaw: float, buffer: Array, entry: Array) -> None:
    """Fill a tape entry for a subject at (x, y, z) from the observer (or from the world's origin if fixed)."""
    c, s = 1.0, 0.0
    if onboard:
        c, s = math.cos(yaw), math.sin(yaw)
    bx, by = c * x + s * y, -s * x + c * y
    rx, ry, rz = bx - camera[0], by - camera[1], z - camera[2]
    observe(
        camera,
        camera[3] * rx + camera[4] * ry + camera[5] * rz,
        camera[6] * rx + camera[7] * ry + camera[8] * rz,
        camera[9] * rx + camera[10] * ry + camera[11] * rz,
        buffer,
    )
    for part in range(2):
        at = 4 * part
        gx = camera[3] * buffer[at + 1] + camera[6] * buffer[at + 2] + camera[9] * buffer[at + 3]
        gy = camera[4] * buffer[at + 1] + camera[7] * buffer[at + 2] + camera[10] * buffer[at + 3]
        entry[at] = buffer[at]
        entry[at + 1] = c * gx - s * gy
        entry[at + 2] = s * gx + c * gy
        entry[at + 3] = gx * by - gy * bx if onboard else 0.0
    entry[RELATIVE_X], entry[RELATIVE_Y] = x, y


@njit("int64(int64, int64)", cache=True, nogil=True)
def first_index(entity: int, n: int) -> int:
    """Return where an entity's x stands in the planner's state."""
    return 3 * entity if entity < n else 3 * n + 4 * (entity - n)


@njit(
    "float64(float64[:,::1], float64[::1], float64[:,::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def penalty(path: Array, options: Array, gradient: Array) -> float:
    """Return repulsion between robots and soft fence at one step; adds d/d(x, y) to gradient (n, 3)."""
    n, cost = path.shape[0], 0.0
    weight, reach, wall = options[5], options[6], options[7]
    for a in range(n):
        for b in range(a):
            dx, dy = path[a, 0] - path[b, 0], path[a, 1] - path[b, 1]
            d2 = dx * dx + dy * dy + 1e-3
            d = math.sqrt(d2)
            if d < reach:
                over = reach / d - 1.0
                cost += weight * over * over
                slope = -2.0 * weight * over * reach / (d2 * d)
                gradient[a, 0] += slope * dx
                gradient[a, 1] += slope * dy
                gradient[b, 0] -= slope * dx
                gradient[b, 1] -= slope * dy
        for axis in range(2):
            low, high = options[8 + 2 * axis] - path[a, axis], path[a, axis] - options[9 + 2 * axis]
            out = max(low, high)
            if out > 0.0:
                cost += wall * out * out
                gradient[a, axis] += 2.0 * wall * (high if high > low else -low)
    return cost


@njit(
    "UniTuple(float64, 2)(float64[::1], float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], "
    "int64[:,::1], float64[:,::1], float64[::1], float64[::1], float64[:,:,::1], float64[:,:,::1], float64[:,:,::1], "
    "float64[:,:,::1], float64[:,:,::1], float64[:,:,::1], float64[:,:,::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def roll_out(
    u: Array,
    poses: Array,
    targets: Array,
    heights: Array,
    prior: Array,
    edges: Indices,
    cameras: Array,
    markers: Array,
    options: Array,
    path: Array,
    motion: Array,
    yaw_columns: Array,
    entries: Array,
    gains: Array,
    yaw_rows: Array,
    penalties: Array,
) -> tuple[float, float]:
    """Return (expected uncertainty of the targets, all other costs) of held controls u (3 n) and fill the tape."""
    n, k, h, m = poses.shape[0], targets.shape[0], heights.shape[0], edges.shape[0]
    P, work, buffer = prior.copy(), np.empty(prior.shape[0]), np.empty(8)
    for r in range(n):
        path[0, r, 0], path[0, r, 1], path[0, r, 2] = poses[r, 0], poses[r, 1], poses[r, 3]
    uncertainty = extra = 0.0
    discount = 1.0
    for i in range(h):
        move(u, path[i], options[0], path[i + 1], motion[i])
        predict(P, motion[i], yaw_columns[i], options)
        for e in range(m):
            a, b = edges[e, 1], edges[e, 2]
            if b < n:
                x, y, z = path[i + 1, b, 0], path[i + 1, b, 1], heights[i, b] + markers[b]
            else:
                ahead = (i + 1) * options[0]
                x, y = targets[b - n, 0] + ahead * targets[b - n, 2], targets[b - n, 1] + ahead * targets[b - n, 3]
                z = markers[b]
            yaw = 0.0
            if a >= 0:
                x, y, z, yaw = x - path[i + 1, a, 0], y - path[i + 1, a, 1], z - heights[i, a], path[i + 1, a, 2]
            entry = entries[i, e]
            look(cameras[edges[e, 0]], a >= 0, x, y, z, yaw, buffer, entry)
            to, origin, turn = first_index(b, n), 3 * a if a >= 0 else -1, 3 * a + 2 if a >= 0 else -1
            row = 3 * e
            correct(P, to, origin, turn, y, entry[W], gains[i, row], yaw_rows[i, row], work)
            below = origin + 1 if a >= 0 else -1
            correct(P, to + 1, below, turn, -x, entry[W], gains[i, row + 1], yaw_rows[i, row + 1], work)
            if b < n:
                correct(P, to + 2, turn, -1, 0.0, entry[V], gains[i, row + 2], yaw_rows[i, row + 2], work)
        discount *= options[1]
        for t in range(k):
            x = 3 * n + 4 * t
            uncertainty += discount * options[TARGET_WEIGHTS + t] * (P[x, x] + P[x + 1, x + 1])
        for x in range(0, 3 * n, 3):
            extra += discount * options[13] * (P[x, x] + P[x + 1, x + 1])
        penalties[i, :, :] = 0.0
        extra += discount * penalty(path[i + 1], options, penalties[i])
    return uncertainty, extra
