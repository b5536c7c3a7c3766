"""Compiled steps of the covariance per axis, and their adjoints.

`P` is the covariance, `W` its adjoint (dc/dP), both symmetric (d, d) and padded to whole vectors (`dense.py`).
Mathematics: docs/explanation/planning.md 1, 2.
"""

import numpy as np

from groundstation.arrays import Matrix
from groundstation.kernel import kernel
from groundstation.planning.dense import PIVOTS, copy_upper, multiply, multiply_to_symmetric, padded
from groundstation.planning.elimination import negative_inverse
from groundstation.planning.records import TARGET_STATES, CostOptions


@kernel()
def predict(P: Matrix, n: int, d: int, options: CostOptions) -> None:
    """P <- F P F^T + Q over its first d entries: targets move on, all become less certain."""
    dt, q_acc = options.step_s, options.target_acceleration_noise
    for x in range(n, d, TARGET_STATES):
        for j in range(d):
            P[x, j] += dt * P[x + 1, j]
    for i in range(d):
        for x in range(n, d, TARGET_STATES):
            P[i, x] += dt * P[i, x + 1]
    for r in range(n):
        P[r, r] += options.robot_position_noise * dt
    for x in range(n, d, TARGET_STATES):
        P[x, x] += q_acc * dt * dt * dt / 3.0
        P[x, x + 1] += q_acc * dt * dt / 2.0
        P[x + 1, x] += q_acc * dt * dt / 2.0
        P[x + 1, x + 1] += q_acc * dt


@kernel()
def predict_adjoint(W: Matrix, n: int, d: int, dt: float) -> None:
    """W <- F^T W F over its first d entries."""
    for x in range(n, d, TARGET_STATES):
        for j in range(d):
            W[x + 1, j] += dt * W[x, j]
    for i in range(d):
        for x in range(n, d, TARGET_STATES):
            W[i, x + 1] += dt * W[i, x]


@kernel()
def room_for(P: Matrix) -> Matrix:
    """Return a copy of P padded for `dense` to whole vectors, with an identity in the padding."""
    d = P.shape[0]
    m = padded(d)
    wide = np.zeros((m, m))
    for i in range(m):
        wide[i, i] = 1.0
    for i in range(d):
        for j in range(d):
            wide[i, j] = P[i, j]
    return wide


@kernel()
def invert(A: Matrix) -> None:
    """A <- A^-1 for a matrix as `room_for` returns it; NaN on the diagonal if it is not positive definite."""
    m = A.shape[0]
    sound = negative_inverse(A, np.empty((2 * PIVOTS, m)))
    for i in range(m):
        for j in range(i, m):
            A[i, j] = -A[i, j]
    copy_upper(A)
    if not sound:
        for i in range(m):
            A[i, i] = np.nan


@kernel()
def between(A: Matrix, B: Matrix, C: Matrix, work: Matrix) -> None:
    """C <- A B A for symmetric A as `room_for` returns them; work (m, m)."""
    multiply(B, A, work)
    multiply_to_symmetric(A, work, C)
