"""Compiled covariance steps of the rollout and their adjoints.

State of the planner: x, y, yaw of each robot (3 each), then x, y, vx, vy of each target (4 each).
`P` is the covariance, `W` its adjoint (dc/dP), both symmetric (d, d). Mathematics: README.md.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


@njit("void(float64[:,::1], float64[:,::1], float64[:,::1], float64[::1])", cache=True, nogil=True, error_model="numpy")
def predict(P: Array, motion: Array, yaw_columns: Array, options: Array) -> None:
    """P <- F P F^T + Q; motion (n, 3) holds each robot's displacement; keeps F P e_yaw of each robot."""
    n, d = motion.shape[0], P.shape[0]
    dt, q_xy, q_yaw, q_acc = options[0], options[2], options[3], options[4]
    for r in range(n):
        x, y, yaw = 3 * r, 3 * r + 1, 3 * r + 2
        for j in range(d):
            P[x, j] -= motion[r, 1] * P[yaw, j]
            P[y, j] += motion[r, 0] * P[yaw, j]
    for x in range(3 * n, d, 4):
        for j in range(d):
            P[x, j] += dt * P[x + 2, j]
            P[x + 1, j] += dt * P[x + 3, j]
    for i in range(d):
        for r in range(n):
            P[i, 3 * r] -= motion[r, 1] * P[i, 3 * r + 2]
            P[i, 3 * r + 1] += motion[r, 0] * P[i, 3 * r + 2]
            yaw_columns[r, i] = P[i, 3 * r + 2]
        for x in range(3 * n, d, 4):
            P[i, x] += dt * P[i, x + 2]
            P[i, x + 1] += dt * P[i, x + 3]
    for r in range(n):
        P[3 * r, 3 * r] += q_xy * dt
        P[3 * r + 1, 3 * r + 1] += q_xy * dt
        P[3 * r + 2, 3 * r + 2] += q_yaw * dt
    for first in range(3 * n, d, 4):
        for x in range(first, first + 2):
            P[x, x] += q_acc * dt * dt * dt / 3.0
            P[x, x + 2] += q_acc * dt * dt / 2.0
            P[x + 2, x] += q_acc * dt * dt / 2.0
            P[x + 2, x + 2] += q_acc * dt


@njit(
    "void(float64[:,::1], float64[:,::1], float64[:,::1], float64, float64[:,::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def predict_adjoint(W: Array, motion: Array, yaw_columns: Array, dt: float, motion_adjoint: Array) -> None:
    """W <- F^T W F; writes dc/d displacement through F into motion_adjoint (n, 2)."""
    n, d = motion.shape[0], W.shape[0]
    for r in range(n):
        along_x = along_y = 0.0
        for j in range(d):
            along_x += W[3 * r, j] * yaw_columns[r, j]
            along_y += W[3 * r + 1, j] * yaw_columns[r, j]
        motion_adjoint[r, 0] = 2.0 * along_y
        motion_adjoint[r, 1] = -2.0 * along_x
    for r in range(n):
        x, y, yaw = 3 * r, 3 * r + 1, 3 * r + 2
        for j in range(d):
            W[yaw, j] += motion[r, 0] * W[y, j] - motion[r, 1] * W[x, j]
    for x in range(3 * n, d, 4):
        for j in range(d):
            W[x + 2, j] += dt * W[x, j]
            W[x + 3, j] += dt * W[x + 1, j]
    for i in range(d):
        for r in range(n):
            x, y, yaw = 3 * r, 3 * r + 1, 3 * r + 2
            W[i, yaw] += motion[r, 0] * W[i, y] - motion[r, 1] * W[i, x]
        for x in range(3 * n, d, 4):
            W[i, x + 2] += dt * W[i, x]
            W[i, x + 3] += dt * W[i, x + 1]


@njit(
    "void(float64[:,::1], int64, int64, int64, float64, float64, float64[::1], float64[::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def correct(
    P: Array, to: int, origin: int, yaw: int, lever: float, w: float, g: Array, yaw_row: Array, v: Array
) -> None:
    """Fuse the scalar a^T x with information w: a = e_to - e_origin + lever e_yaw (an index < 0 is left out).

    Keeps g = P+ a and row `yaw` of P+ for the adjoint; v is work space.
    """
    d = P.shape[0]
    for j in range(d):
        v[j] = P[to, j]
    if origin >= 0:
        for j in range(d):
            v[j] -= P[origin, j]
    if yaw >= 0:
        for j in range(d):
            v[j] += lever * P[yaw, j]
    spread = v[to]
    if origin >= 0:
        spread -= v[origin]
    if yaw >= 0:
        spread += lever * v[yaw]
    scale = 1.0 / (1.0 + w * spread)
    for j in range(d):
        g[j] = v[j] * scale
    for i in range(d):
        factor = w * scale * v[i]
        for j in range(d):
            P[i, j] -= factor * v[j]
    if yaw >= 0:
        for j in range(d):
            yaw_row[j] = P[yaw, j]


@njit(
    "UniTuple(float64, 2)(float64[:,::1], int64, int64, int64, float64, float64, float64[::1], float64[::1], "
    "float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def correct_adjoint(
    W: Array, to: int, origin: int, yaw: int, lever: float, w: float, g: Array, yaw_row: Array, y: Array
) -> tuple[float, float]:
    """W <- (I - a K^T) W (I - K a^T); returns (dc/dw, dc/d lever); y is work space."""
    d = W.shape[0]
    gy = lever_adjoint = 0.0
    for i in range(d):
        total = 0.0
        for j in range(d):
            total += W[i, j] * g[j]
        y[i] = total
        gy += g[i] * total
    if yaw >= 0:
        for j in range(d):
            lever_adjoint += yaw_row[j] * y[j]
    # W -= a q^T + q a^T with q = w y - (w^2 g.y / 2) a.
    for j in range(d):
        y[j] *= w
    half = 0.5 * w * w * gy
    y[to] -= half
    if origin >= 0:
        y[origin] += half
    if yaw >= 0:
        y[yaw] -= half * lever
    for part in range(3):
        index = to if part == 0 else (origin if part == 1 else yaw)
        if index < 0:
            continue
        weight = 1.0 if part == 0 else (-1.0 if part == 1 else lever)
        for j in range(d):
            W[index, j] -= weight * y[j]
        for j in range(d):
            W[j, index] -= weight * y[j]
    return -gy, -2.0 * w * lever_adjoint
