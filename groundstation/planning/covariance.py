"""Compiled steps of the covariance per axis, and their adjoints.

`P` is the covariance, `W` its adjoint (dc/dP), both symmetric (d, d). Mathematics:
docs/explanation/planning.md 1, 2.
"""

import numpy as np

from groundstation.arrays import Matrix
from groundstation.kernel import kernel
from groundstation.planning.records import TARGET_STATES, CostOptions


@kernel()
def predict(P: Matrix, n: int, options: CostOptions) -> None:
    """P <- F P F^T + Q: targets move on, all become less certain."""
    d, dt, q_acc = P.shape[0], options.step_s, options.target_acceleration_noise
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
def predict_adjoint(W: Matrix, n: int, dt: float) -> None:
    """W <- F^T W F."""
    d = W.shape[0]
    for x in range(n, d, TARGET_STATES):
        for j in range(d):
            W[x + 1, j] += dt * W[x, j]
    for i in range(d):
        for x in range(n, d, TARGET_STATES):
            W[i, x + 1] += dt * W[i, x]


@kernel(contract=True)
def eliminate(A: Matrix, k: int) -> None:
    """Take one Gauss-Jordan step with the pivot A[k, k]."""
    pivot = A[k]
    scale = 1.0 / pivot[k]
    pivot[k] = 1.0
    for j in range(A.shape[0]):
        pivot[j] *= scale
    for i in range(A.shape[0]):
        if i == k:
            continue
        row = A[i]
        factor = row[k]
        row[k] = 0.0
        for j in range(A.shape[0]):
            row[j] -= factor * pivot[j]


@kernel(contract=True)
def invert(A: Matrix) -> None:
    """A <- A^-1 for a positive definite A, by Gauss-Jordan steps (which need no pivoting then), four at a time."""
    d = A.shape[0]
    whole = d - d % 4
    block = np.empty((4, 4))
    for k in range(0, whole, 4):
        p0, p1, p2, p3 = A[k], A[k + 1], A[k + 2], A[k + 3]
        for i in range(4):
            row = A[k + i]
            for j in range(4):
                block[i, j] = row[k + j]
                row[k + j] = 1.0 if i == j else 0.0
        for i in range(4):
            eliminate(block, i)
        b0, b1, b2, b3 = block[0], block[1], block[2], block[3]
        for j in range(d):
            x0, x1, x2, x3 = p0[j], p1[j], p2[j], p3[j]
            p0[j] = b0[0] * x0 + b0[1] * x1 + b0[2] * x2 + b0[3] * x3
            p1[j] = b1[0] * x0 + b1[1] * x1 + b1[2] * x2 + b1[3] * x3
            p2[j] = b2[0] * x0 + b2[1] * x1 + b2[2] * x2 + b2[3] * x3
            p3[j] = b3[0] * x0 + b3[1] * x1 + b3[2] * x2 + b3[3] * x3
        for i in range(d):
            if k <= i < k + 4:
                continue
            row = A[i]
            f0, f1, f2, f3 = row[k], row[k + 1], row[k + 2], row[k + 3]
            row[k] = row[k + 1] = row[k + 2] = row[k + 3] = 0.0
            for j in range(d):
                row[j] -= f0 * p0[j] + f1 * p1[j] + f2 * p2[j] + f3 * p3[j]
    for k in range(whole, d):
        eliminate(A, k)


@kernel(contract=True)
def multiply(A: Matrix, B: Matrix, C: Matrix) -> None:
    """C <- A B for square matrices, four rows of B at a time."""
    d = A.shape[0]
    whole = d - d % 4
    for i in range(d):
        a, c = A[i], C[i]
        for j in range(d):
            c[j] = 0.0
        for k in range(0, whole, 4):
            a0, a1, a2, a3 = a[k], a[k + 1], a[k + 2], a[k + 3]
            b0, b1, b2, b3 = B[k], B[k + 1], B[k + 2], B[k + 3]
            for j in range(d):
                c[j] += a0 * b0[j] + a1 * b1[j] + a2 * b2[j] + a3 * b3[j]
        for k in range(whole, d):
            a0, b0 = a[k], B[k]
            for j in range(d):
                c[j] += a0 * b0[j]


@kernel()
def between(A: Matrix, B: Matrix, C: Matrix, work: Matrix) -> None:
    """C <- A B A for symmetric A; work (d, d)."""
    multiply(A, B, work)
    multiply(work, A, C)
