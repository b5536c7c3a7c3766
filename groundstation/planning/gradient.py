"""Compiled value and exact gradient of the planner's cost: rollout forwards, adjoint backwards over its tape."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from groundstation.planning.covariance import correct_adjoint, predict_adjoint
from groundstation.planning.rollout import (
    RELATIVE_X,
    RELATIVE_Y,
    TARGET_WEIGHTS,
    V_X,
    V_Y,
    V_YAW,
    W_X,
    W_Y,
    W_YAW,
    V,
    W,
    first_index,
    roll_out,
)

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@njit(
    "void(float64[:,::1], int64[:,::1], int64, float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], "
    "float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def undo_edges(
    A: Array, edges: Indices, n: int, entries: Array, gains: Array, yaw_rows: Array, state: Array, work: Array
) -> None:
    """Take the covariance adjoint A back over one step's corrections; adds to dc/d(x, y, yaw) `state` (n, 3)."""
    for e in range(edges.shape[0] - 1, -1, -1):
        a, b, entry, row = edges[e, 1], edges[e, 2], entries[e], 3 * e
        x, y = entry[RELATIVE_X], entry[RELATIVE_Y]
        to, origin, turn = first_index(b, n), 3 * a if a >= 0 else -1, 3 * a + 2 if a >= 0 else -1
        below = origin + 1 if a >= 0 else -1
        v = 0.0
        if b < n:
            v, _ = correct_adjoint(A, to + 2, turn, -1, 0.0, entry[V], gains[row + 2], yaw_rows[row + 2], work)
        w1, lever1 = correct_adjoint(A, to + 1, below, turn, -x, entry[W], gains[row + 1], yaw_rows[row + 1], work)
        w0, lever0 = correct_adjoint(A, to, origin, turn, y, entry[W], gains[row], yaw_rows[row], work)
        w = w0 + w1
        gx = w * entry[W_X] + v * entry[V_X]
        gy = w * entry[W_Y] + v * entry[V_Y]
        if a >= 0:
            gx -= lever1
            gy += lever0
            state[a, 0] -= gx
            state[a, 1] -= gy
            state[a, 2] += w * entry[W_YAW] + v * entry[V_YAW]
        if b < n:
            state[b, 0] += gx
            state[b, 1] += gy


@njit(
    "void(float64[:,::1], float64[:,::1], float64[:,::1], float64, float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def undo_move(state: Array, motion: Array, motion_adjoint: Array, dt: float, gradient: Array) -> None:
    """Take dc/d(x, y, yaw) back over one motion step; adds to dc/du."""
    for r in range(state.shape[0]):
        ax, ay = state[r, 0] + motion_adjoint[r, 0], state[r, 1] + motion_adjoint[r, 1]
        c, s = math.cos(motion[r, 2]), math.sin(motion[r, 2])
        turn = motion[r, 0] * ay - motion[r, 1] * ax
        gradient[3 * r] += dt * (c * ax + s * ay)
        gradient[3 * r + 1] += dt * (c * ay - s * ax)
        gradient[3 * r + 2] += dt * (state[r, 2] + 0.5 * turn)
        state[r, 2] += turn


@njit(
    "float64(float64[::1], float64[::1], float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], "
    "int64[:,::1], float64[:,::1], float64[::1], float64[::1], boolean, float64[::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def evaluate(
    u: Array,
    scale: Array,
    poses: Array,
    targets: Array,
    heights: Array,
    prior: Array,
    edges: Indices,
    cameras: Array,
    markers: Array,
    options: Array,
    wants_gradient: bool,
    gradient: Array,
    report: Array,
) -> float:
    """Return the cost of held controls u (3 n) [m/s, m/s, rad/s; base_stabilized], and dc/du if wanted.

    scale (3 n): bounds of u, for the effort term; report (1 + m): uncertainty alone, mean information of each edge.
    """
    n, h, m, d = poses.shape[0], heights.shape[0], edges.shape[0], prior.shape[0]
    path, motion = np.empty((h + 1, n, 3)), np.empty((h, n, 3))
    yaw_columns, entries = np.empty((h, n, d)), np.empty((h, m, 10))
    gains, yaw_rows = np.empty((h, 3 * m, d)), np.empty((h, 3 * m, d))
    penalties = np.empty((h, n, 3))
    uncertainty, extra = roll_out(
        u, poses, targets, heights, prior, edges, cameras, markers, options,
        path, motion, yaw_columns, entries, gains, yaw_rows, penalties,
    )  # fmt: skip
    report[0] = uncertainty
    for e in range(m):
        report[1 + e] = 0.0
        for i in range(h):
            report[1 + e] += entries[i, e, W] / h
    effort = 0.0
    for j in range(3 * n):
        effort += options[12] * (u[j] / scale[j]) ** 2
        gradient[j] = 2.0 * options[12] * u[j] / (scale[j] * scale[j])
    if wants_gradient:
        A, state, back, work = np.zeros((d, d)), np.zeros((n, 3)), np.empty((n, 2)), np.empty(d)
        for i in range(h - 1, -1, -1):
            discount = options[1] ** (i + 1)
            for t in range(targets.shape[0]):
                x, weight = 3 * n + 4 * t, discount * options[TARGET_WEIGHTS + t]
                A[x, x] += weight
                A[x + 1, x + 1] += weight
            for r in range(n):
                A[3 * r, 3 * r] += discount * options[13]
                A[3 * r + 1, 3 * r + 1] += discount * options[13]
                for axis in range(2):
                    state[r, axis] += discount * penalties[i, r, axis]
            undo_edges(A, edges, n, entries[i], gains[i], yaw_rows[i], state, work)
            predict_adjoint(A, motion[i], yaw_columns[i], options[0], back)
            undo_move(state, motion[i], back, options[0], gradient)
    return uncertainty + extra + effort
