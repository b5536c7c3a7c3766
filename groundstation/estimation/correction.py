"""One correction of the joint belief by a measurement of up to four rows that touches two blocks of the state.

P - (L^-1 H P)^T (L^-1 H P) with S = L L^T: Joseph's form less a square of rounding errors (see `apply`), made when P is
needed (deferred.py). P stays exactly symmetric, and positive definite because R is never so small that double precision
could not tell it from an exact measurement; with several at one instant, as long as none is better than 1e-6 (1 um).
"""

import math
from typing import NamedTuple

import numpy as np

from groundstation.arrays import IntVector, Matrix, Vector
from groundstation.estimation.deferred import count_in, put_off
from groundstation.estimation.filter_state import Belief, Deferred
from groundstation.estimation.linear import cholesky
from groundstation.estimation.records import MAX_ROWS, EntityRow, Innovation
from groundstation.estimation.register_blocks import add_rows
from groundstation.kernel import kernel


class Jacobian(NamedTuple):
    """The non-zero columns of a measurement's Jacobian: F (4, their count), and their indices `at`."""

    F: Matrix
    at: IntVector


@kernel(inlined=True)
def gather(block: EntityRow, H: Matrix, found: Jacobian, count: int) -> int:
    """Append the non-zero columns of H (4, block) to those found so far; returns their number."""
    for k in range(block.size):
        if H[0, k] != 0.0 or H[1, k] != 0.0 or H[2, k] != 0.0 or H[3, k] != 0.0:
            found.at[count] = block.start + k
            for i in range(MAX_ROWS):
                found.F[i, count] = H[i, k]
            count += 1
    return count


@kernel(inlined=True)
def project(belief: Belief, deferred: Deferred, jacobian: Jacobian, count: int, W: Matrix) -> None:
    """Write H P into W (4, n)."""
    for i in range(W.shape[0]):
        for j in range(W.shape[1]):
            W[i, j] = 0.0
    add_rows(W, jacobian.F, belief.P, jacobian.at, count)
    count_in(W, jacobian.F, jacobian.at, count, deferred)


@kernel(inlined=True)
def measured_covariance(W: Matrix, jacobian: Jacobian, count: int, rows: int, HPH: Matrix) -> None:
    """Write H P H^T for W = H P: the covariance of the predicted measurement, without noise."""
    for i in range(rows):
        for j in range(rows):
            value = 0.0
            for k in range(count):
                value += jacobian.F[i, k] * W[j, jacobian.at[k]]
            HPH[i, j] = value


# A measurement this much better than the prior is exact to double precision.
RESOLUTION = 1e-10


@kernel(inlined=True)
def bound_precision(HPH: Matrix, R: Matrix, rows: int) -> None:
    """Raise R to the resolution of double precision relative to H P H^T, so that P stays positive definite."""
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
    """Raise R so that S grows by `factor`: the soft gate."""
    for i in range(rows):
        for j in range(rows):
            R[i, j] = factor * R[i, j] + (factor - 1.0) * 0.5 * (HPH[i, j] + HPH[j, i])


@kernel(inlined=True)
def apply(mean: Vector, P: Matrix, deferred: Deferred, rows: int, W: Matrix, factor: Matrix, y: Vector) -> None:
    """Correct the mean, and defer the correction of P, given W = H P (4, n) and the Cholesky factor L of S.

    Joseph's form (I - K H) P (I - K H)^T + K R K^T, multiplied out with V = L^-1 W and U = L^T K, is P - V^T V + (U -
    V)^T (U - V). U - V is the rounding error of the gain (1e-16 of V): its square is neglected.
    """
    n, first, u = P.shape[0], put_off(P, deferred, rows), np.empty(4)
    V = deferred.V[first : first + rows]
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


@kernel()
def apply_to_block(mean: Vector, P: Matrix, block: EntityRow, rows: int, W: Matrix, innovation: Innovation) -> None:
    """Correct only one entity's block, given W = H P: all other rows of the gain are taken as zero.

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
