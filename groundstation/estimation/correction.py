"""One correction of the joint belief by a measurement of up to four rows that touches two blocks of the state.

Joseph's form: (I - K H) P (I - K H)^T + K R K^T, symmetric by construction and positive definite for any gain.
"""

import math

import numpy as np

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.kernel import kernel
from groundstation.estimation.linear import cholesky, solve_rows


@kernel("void(float64[:,::1], int64, int64, float64[:,::1], int64, int64, float64[:,::1], int64, float64[:,::1])")
def project(
    P: Array, start_a: int, size_a: int, H_a: Array, start_b: int, size_b: int, H_b: Array, rows: int, W: Array
) -> None:
    """Write H P (rows, n) into W, H being zero outside blocks a and b."""
    n = P.shape[0]
    for i in range(rows):
        for j in range(n):
            W[i, j] = 0.0
        for k in range(size_a):
            f = H_a[i, k]
            if f != 0.0:
                for j in range(n):
                    W[i, j] += f * P[start_a + k, j]
        for k in range(size_b):
            f = H_b[i, k]
            if f != 0.0:
                for j in range(n):
                    W[i, j] += f * P[start_b + k, j]


@kernel("void(float64[:,::1], int64, int64, float64[:,::1], int64, int64, float64[:,::1], int64, float64[:,::1])")
def project_columns(
    A: Array, start_a: int, size_a: int, H_a: Array, start_b: int, size_b: int, H_b: Array, rows: int, B: Array
) -> None:
    """Write H A^T (rows, m) into B for A (m, n): the projection of each row of A."""
    for i in range(rows):
        for j in range(A.shape[0]):
            value = 0.0
            for k in range(size_a):
                value += H_a[i, k] * A[j, start_a + k]
            for k in range(size_b):
                value += H_b[i, k] * A[j, start_b + k]
            B[i, j] = value


# Double precision cannot tell a measurement that is this much better than what was known from an exact one.
RESOLUTION = 1e-10


@kernel("void(float64[:,::1], float64[:,::1], int64)")
def bound_precision(HPH: Array, R: Array, rows: int) -> None:
    """Raise R to what double precision resolves beside H P H^T, so that P stays positive definite."""
    for i in range(rows):
        R[i, i] += RESOLUTION * abs(HPH[i, i])


@kernel("float64(float64[:,::1], float64[:,::1], float64[::1], int64, float64[:,::1])")
def surprise(HPH: Array, R: Array, y: Array, rows: int, factor: Array) -> float:
    """Return the NIS of a residual and leave the Cholesky factor of S = H P H^T + R; -1 if S is not PD."""
    for i in range(rows):
        for j in range(rows):
            factor[i, j] = 0.5 * (HPH[i, j] + HPH[j, i]) + R[i, j]
    if not cholesky(factor, rows):
        return -1.0
    nis = 0.0
    u = np.empty(4)
    for i in range(rows):
        value = y[i]
        for k in range(i):
            value -= factor[i, k] * u[k]
        u[i] = value / factor[i, i]
        nis += u[i] * u[i]
    return nis


@kernel("float64(float64[:,::1], int64)")
def log_determinant(factor: Array, rows: int) -> float:
    """Return log det S from its Cholesky factor."""
    value = 0.0
    for i in range(rows):
        value += 2.0 * math.log(factor[i, i])
    return value


@kernel("void(float64[:,::1], float64[:,::1], int64, float64)")
def inflate(HPH: Array, R: Array, rows: int, factor: float) -> None:
    """Raise R so that S becomes `factor` times what it was: the soft gate."""
    for i in range(rows):
        for j in range(rows):
            R[i, j] = factor * R[i, j] + (factor - 1.0) * 0.5 * (HPH[i, j] + HPH[j, i])


@kernel("void(float64[:,::1], float64[::1], float64[::1], float64[::1], float64[::1])")
def subtract_two(P: Array, K_0: Array, C_0: Array, K_1: Array, C_1: Array) -> None:
    """Subtract K^T C + C^T K from P for two rows each, in one pass and symmetric to the bit."""
    for a in range(P.shape[0]):
        row, k_0, c_0, k_1, c_1 = P[a], K_0[a], C_0[a], K_1[a], C_1[a]
        for j in range(P.shape[0]):
            row[j] -= (k_0 * C_0[j] + c_0 * K_0[j]) + (k_1 * C_1[j] + c_1 * K_1[j])


@kernel("void(float64[:,::1], float64[:,::1], float64[:,::1])")
def subtract_four(P: Array, K: Array, C: Array) -> None:
    """Subtract K^T C + C^T K from P for four rows each, in one pass and symmetric to the bit."""
    K_0, K_1, K_2, K_3 = K[0], K[1], K[2], K[3]
    C_0, C_1, C_2, C_3 = C[0], C[1], C[2], C[3]
    for a in range(P.shape[0]):
        row, k_0, c_0, k_1, c_1 = P[a], K_0[a], C_0[a], K_1[a], C_1[a]
        k_2, c_2, k_3, c_3 = K_2[a], C_2[a], K_3[a], C_3[a]
        for j in range(P.shape[0]):
            row[j] -= ((k_0 * C_0[j] + c_0 * K_0[j]) + (k_1 * C_1[j] + c_1 * K_1[j])) + (
                (k_2 * C_2[j] + c_2 * K_2[j]) + (k_3 * C_3[j] + c_3 * K_3[j])
            )


@kernel("void(float64[::1], float64[:,::1], int64, float64[:,::1], float64[:,::1], float64[:,::1], float64[::1])")
def apply(mean: Array, P: Array, rows: int, W: Array, S: Array, factor: Array, y: Array) -> None:
    """Correct mean and P in place, given W = H P (4, n), S and its Cholesky factor.

    Joseph's form, multiplied out: (I - K H) P (I - K H)^T + K R K^T = P - K C - (K C)^T with C = W - S K^T / 2, which
    is symmetric and does not need K to be the best gain.
    """
    n = P.shape[0]
    K, C = np.zeros((4, n)), np.zeros((4, n))
    solve_rows(factor, rows, W, K)
    for i in range(rows):
        for j in range(n):
            mean[j] += K[i, j] * y[i]
            C[i, j] = W[i, j]
        for k in range(rows):
            f = 0.5 * S[i, k]
            for j in range(n):
                C[i, j] -= f * K[k, j]
    if rows > 2:
        subtract_four(P, K, C)
    else:
        subtract_two(P, K[0], C[0], K[1], C[1])


@kernel("boolean(float64[::1], float64[:,::1], int64[:,::1], float64[:,::1])")
def is_distribution(mean: Array, P: Array, entities: IntArray, aux: Array) -> bool:
    """Return whether mean and P are finite and P is positive definite over the active entities."""
    n = P.shape[0]
    index = np.empty(n, np.int64)
    size = 0
    for e in range(entities.shape[0]):
        if aux[e, s.ACTIVE] != 0.0:
            for k in range(entities[e, s.ENTITY_SIZE]):
                index[size] = entities[e, s.ENTITY_START] + k
                size += 1
    work = np.empty((n, n))
    for i in range(size):
        if not math.isfinite(mean[index[i]]):
            return False
        for j in range(size):
            work[i, j] = P[index[i], index[j]]
    return cholesky(work, size)
