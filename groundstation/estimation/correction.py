"""One correction of the joint belief by a measurement of up to four rows that touches two blocks of the state.

P - (L^-1 H P)^T (L^-1 H P) with S = L L^T: Joseph's form less a square of rounding errors (see `apply`). P stays
symmetric to the bit, and positive definite because R is never below what double precision tells from an exact
measurement.
"""

import math
from typing import NamedTuple

import numpy as np

from groundstation.arrays import Matrix, Vector
from groundstation.estimation.filter_state import Belief
from groundstation.estimation.linear import cholesky
from groundstation.estimation.records import EntityRow, Innovation
from groundstation.kernel import kernel


class Touched(NamedTuple):
    """A block of the state and the Jacobian (rows, block) of a measurement by it."""

    start: int
    size: int
    H: Matrix


@kernel(inlined=True)
def touched(entity: EntityRow, H: Matrix) -> Touched:
    """Return an entity's block with the Jacobian by it."""
    return Touched(entity.start, entity.size, H)


@kernel(inlined=True)
def project(P: Matrix, a: Touched, b: Touched, rows: int, W: Matrix) -> None:
    """Write H P (rows, n) into W, H being zero outside blocks a and b."""
    n = P.shape[0]
    for i in range(rows):
        for j in range(n):
            W[i, j] = 0.0
        for k in range(a.size):
            f = a.H[i, k]
            if f != 0.0:
                for j in range(n):
                    W[i, j] += f * P[a.start + k, j]
        for k in range(b.size):
            f = b.H[i, k]
            if f != 0.0:
                for j in range(n):
                    W[i, j] += f * P[b.start + k, j]


@kernel(inlined=True)
def project_columns(A: Matrix, a: Touched, b: Touched, rows: int, B: Matrix) -> None:
    """Write H A^T (rows, m) into B for A (m, n): the projection of each row of A."""
    for i in range(rows):
        for j in range(A.shape[0]):
            value = 0.0
            for k in range(a.size):
                value += a.H[i, k] * A[j, a.start + k]
            for k in range(b.size):
                value += b.H[i, k] * A[j, b.start + k]
            B[i, j] = value


# Double precision cannot tell a measurement that is this much better than what was known from an exact one.
RESOLUTION = 1e-10


@kernel(inlined=True)
def bound_precision(HPH: Matrix, R: Matrix, rows: int) -> None:
    """Raise R to what double precision resolves beside H P H^T, so that P stays positive definite."""
    for i in range(rows):
        R[i, i] += RESOLUTION * abs(HPH[i, i])


@kernel(inlined=True)
def surprise(HPH: Matrix, R: Matrix, y: Vector, rows: int, factor: Matrix) -> float:
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


@kernel(inlined=True)
def log_determinant(factor: Matrix, rows: int) -> float:
    """Return log det S from its Cholesky factor."""
    product = 1.0
    for i in range(rows):
        product *= factor[i, i]
    return 2.0 * math.log(product)


@kernel()
def inflate(HPH: Matrix, R: Matrix, rows: int, factor: float) -> None:
    """Raise R so that S becomes `factor` times what it was: the soft gate."""
    for i in range(rows):
        for j in range(rows):
            R[i, j] = factor * R[i, j] + (factor - 1.0) * 0.5 * (HPH[i, j] + HPH[j, i])


@kernel()
def subtract_two(P: Matrix, V: Matrix) -> None:
    """Subtract V^T V from P for two rows, in one pass and symmetric to the bit."""
    V_0, V_1 = V[0], V[1]
    for a in range(P.shape[0]):
        row, v_0, v_1 = P[a], V_0[a], V_1[a]
        for j in range(P.shape[0]):
            row[j] -= v_0 * V_0[j] + v_1 * V_1[j]


@kernel(inlined=True)
def subtract_four(P: Matrix, V: Matrix) -> None:
    """Subtract V^T V from P for the first four rows of V, in one pass and symmetric to the bit.

    Four rows of P at a time share what is loaded of V: nearly half of a correction's time is spent here. The fifth row
    of V is room for rows beyond the last of P.
    """
    n = P.shape[0]
    V_0, V_1, V_2, V_3 = V[0], V[1], V[2], V[3]
    spare = V[4]
    for a in range(0, n, 4):
        b, c, d = min(a + 1, n - 1), min(a + 2, n - 1), min(a + 3, n - 1)
        p = P[a]
        q = P[b] if b == a + 1 else spare
        r = P[c] if c == a + 2 else spare
        t = P[d] if d == a + 3 else spare
        e_0, e_1, e_2, e_3 = V_0[a], V_1[a], V_2[a], V_3[a]
        f_0, f_1, f_2, f_3 = V_0[b], V_1[b], V_2[b], V_3[b]
        g_0, g_1, g_2, g_3 = V_0[c], V_1[c], V_2[c], V_3[c]
        h_0, h_1, h_2, h_3 = V_0[d], V_1[d], V_2[d], V_3[d]
        for j in range(n):
            v_0, v_1, v_2, v_3 = V_0[j], V_1[j], V_2[j], V_3[j]
            p[j] -= (e_0 * v_0 + e_1 * v_1) + (e_2 * v_2 + e_3 * v_3)
            q[j] -= (f_0 * v_0 + f_1 * v_1) + (f_2 * v_2 + f_3 * v_3)
            r[j] -= (g_0 * v_0 + g_1 * v_1) + (g_2 * v_2 + g_3 * v_3)
            t[j] -= (h_0 * v_0 + h_1 * v_1) + (h_2 * v_2 + h_3 * v_3)


@kernel(inlined=True)
def apply(mean: Vector, P: Matrix, rows: int, W: Matrix, factor: Matrix, y: Vector) -> None:
    """Correct mean and P in place, given W = H P (4, n) and the Cholesky factor L of S.

    Joseph's form (I - K H) P (I - K H)^T + K R K^T, multiplied out with V = L^-1 W and U = L^T K, is
    P - V^T V + (U - V)^T (U - V). U - V is what rounding did to the gain (1e-16 of V): its square is left out.
    """
    n = P.shape[0]
    V, u = np.zeros((5, n)), np.empty(4)
    for i in range(rows):
        u[i] = y[i]
        for j in range(n):
            V[i, j] = W[i, j]
        for k in range(i):
            f = factor[i, k]
            u[i] -= f * u[k]
            for j in range(n):
                V[i, j] -= f * V[k, j]
        d = 1.0 / factor[i, i]
        u[i] *= d
        for j in range(n):
            V[i, j] *= d
            mean[j] += V[i, j] * u[i]
    if rows > 2:
        subtract_four(P, V)
    else:
        subtract_two(P, V)


@kernel()
def apply_to_block(mean: Vector, P: Matrix, block: EntityRow, rows: int, W: Matrix, innovation: Innovation) -> None:
    """Correct one entity's block and nothing else, given W = H P: the others' rows of the gain are taken as zero.

    Schmidt's consider update: K H P is V^T V on the block and between it and the others, with V = L^-1 W.
    """
    n, factor = P.shape[0], innovation.factor
    V, u = np.zeros((rows, n)), np.empty(rows)
    for i in range(rows):
        u[i] = innovation.y[i]
        for k in range(i):
            u[i] -= factor[i, k] * u[k]
        u[i] /= factor[i, i]
        for j in range(n):
            V[i, j] = W[i, j]
            for k in range(i):
                V[i, j] -= factor[i, k] * V[k, j]
            V[i, j] /= factor[i, i]
    start, stop = block.start, block.start + block.size
    for i in range(rows):
        for a in range(start, stop):
            mean[a] += V[i, a] * u[i]
            for j in range(n):
                P[a, j] -= V[i, a] * V[i, j]
                if j < start or j >= stop:
                    P[j, a] = P[a, j]


@kernel()
def is_distribution(belief: Belief) -> bool:
    """Return whether mean and P are finite and P is positive definite over the active entities."""
    mean, P, entities = belief.mean, belief.P, belief.entities
    n = P.shape[0]
    index = np.empty(n, np.int64)
    size = 0
    for e in range(entities.shape[0]):
        if belief.memory[e].active != 0:
            for k in range(entities[e].size):
                index[size] = entities[e].start + k
                size += 1
    work = np.empty((n, n))
    for i in range(size):
        if not math.isfinite(mean[index[i]]):
            return False
        for j in range(size):
            work[i, j] = P[index[i], index[j]]
    return cholesky(work, size)
