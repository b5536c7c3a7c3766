"""Covariance rollout in information form, and its adjoint.

Per axis the joint covariance is an (n + 1, n + 1) matrix P (isotropic sensors), target last. With D = Q^-1:
L_i = Lm_i + Laplacian(w_i), Lm_{i+1} = D - D (L_i + D)^-1 D, cost = sum_i 2 gamma^i / chol(L_i)[t, t]^2.
"""

import numpy as np
from numba import njit

from groundstation.planning.planar.lapack import cholesky, inverse_of_factor, solve_with_factor


@njit("void(f8[:, ::1])", cache=True, nogil=True)
def _mirror(matrix):  # type: ignore[no-untyped-def]
    for a in range(matrix.shape[0]):
        for b in range(a):
            matrix[a, b] = matrix[b, a]


@njit("b1(f8[:, ::1], f8[::1], f8[:, ::1], i8[::1], i4[::1])", cache=True, nogil=True)
def predicted_information(covariance, variance, out, addresses, integers):  # type: ignore[no-untyped-def]
    """Write (P + Q)^-1; False when P + Q is not positive definite."""
    size = covariance.shape[0]
    out[:, :] = covariance
    for a in range(size):
        out[a, a] += variance[a]
    if not cholesky(out, addresses, integers) or not inverse_of_factor(out, addresses, integers):
        return False
    _mirror(out)
    return True


@njit("void(f8[:, ::1], i8[:, ::1], i8, f8[::1])", cache=True, nogil=True)
def _add_laplacian(matrix, edges, count, information):  # type: ignore[no-untyped-def]
    """Add sum_e w_e a_e a_e^T to the upper triangle."""
    for e in range(count):
        a, b, w = edges[e, 0], edges[e, 1], information[e]
        matrix[b, b] += w
        if a >= 0:
            matrix[a, a] += w
            matrix[min(a, b), max(a, b)] -= w


@njit(
    "b1(f8[:, :, ::1], f8[:, :, ::1], i8, f8[::1], b1, f8[:, ::1], i8[::1], i4[::1])",
    cache=True,
    nogil=True,
)
def _predict(prior, factor, i, variance, stable, work, addresses, integers):  # type: ignore[no-untyped-def]
    """Write Lm_{i+1} from the factor of L_i; `stable` goes through the covariance.

    The short form D - D (L + D)^-1 D loses digits when the process noise is tiny against P (eps * max(D P)).
    """
    size = variance.shape[0]
    if stable:
        work[:, :] = factor[i]
        if not inverse_of_factor(work, addresses, integers):
            return False
        for a in range(size):
            work[a, a] += variance[a]
        if not cholesky(work, addresses, integers) or not inverse_of_factor(work, addresses, integers):
            return False
        prior[i + 1] = work
        _mirror(prior[i + 1])
        return True
    for a in range(size):
        work[a, a] += 1.0 / variance[a]
    if not cholesky(work, addresses, integers) or not inverse_of_factor(work, addresses, integers):
        return False
    for a in range(size):
        da = 1.0 / variance[a]
        for b in range(a, size):
            value = -da * work[a, b] / variance[b]
            prior[i + 1, a, b] = value
            prior[i + 1, b, a] = value
        prior[i + 1, a, a] += da
    return True


@njit(
    "f8(f8[:, :, ::1], f8[:, :, ::1], i8[:, ::1], i8, f8[:, ::1], f8[::1], f8, b1, f8[:, ::1], i8[::1], i4[::1])",
    cache=True,
    nogil=True,
)
def rollout_cost(  # type: ignore[no-untyped-def]
    prior, factor, edges, count, information, variance, discount, stable, work, addresses, integers
):
    """Return the discounted trace of the target's covariance [m^2], or -1 when a matrix is not positive definite.

    prior[0] holds Lm_1; prior (h, N, N) and factor (h, N, N) are filled for the adjoint; information (h, m).
    """
    steps, target = prior.shape[0], prior.shape[1] - 1
    cost, weight = 0.0, 1.0
    for i in range(steps):
        current = factor[i]
        current[:, :] = prior[i]
        _add_laplacian(current, edges, count, information[i])
        if not stable:
            work[:, :] = current
        if not cholesky(current, addresses, integers):
            return -1.0
        weight *= discount
        cost += 2.0 * weight / (current[target, target] * current[target, target])
        if i + 1 < steps and not _predict(prior, factor, i, variance, stable, work, addresses, integers):
            return -1.0
    return cost


@njit(
    "void(f8[:, :, ::1], f8[:, :, ::1], f8, f8[:, :, ::1], f8[:, ::1], i8[::1], i4[::1])",
    cache=True,
    nogil=True,
    fastmath=True,
)
def adjoint_columns(prior, factor, discount, columns, carried, addresses, integers):  # type: ignore[no-untyped-def]
    """Write the rank-one adjoints: columns[i, 0..h-1-i] = Y_i, so that dc/dw_ab,i = -sum_c (Y[c, b] - Y[c, a])^2."""
    steps, size = prior.shape[0], prior.shape[1]
    for i in range(steps - 1, -1, -1):
        count = steps - i
        y = columns[i]
        y[: count - 1] = carried[: count - 1]
        y[count - 1, :] = 0.0
        y[count - 1, size - 1] = np.sqrt(2.0 * discount ** (i + 1))
        solve_with_factor(factor[i], y, count, addresses, integers)
        if i > 0:
            for c in range(count):
                for a in range(size):
                    total = 0.0
                    for b in range(size):
                        total += prior[i, a, b] * y[c, b]
                    carried[c, a] = total


@njit(
    "void(f8[:, ::1], i8[:, ::1], i8, f8[::1], f8[::1], f8[:, ::1], i8, f8[::1], f8, f8[:, ::1])",
    cache=True,
    nogil=True,
    fastmath=True,
)
def add_position_gradient(  # type: ignore[no-untyped-def]
    position, edges, count, distance, information, columns, used, constants, scale, gradient
):
    """Add scale * dc/dposition of one step to gradient (n, 2): dw/dd = -w (1 - sigma^2 w) / s."""
    sigma2, softness, robots = constants[0] * constants[0], constants[2], gradient.shape[0]
    for e in range(count):
        a, b = edges[e, 0], edges[e, 1]
        sensitivity = 0.0
        for c in range(used):
            difference = columns[c, b]
            if a >= 0:
                difference -= columns[c, a]
            sensitivity -= difference * difference
        w = information[e]
        factor = -scale * sensitivity * w * (1.0 - sigma2 * w) / (softness * distance[e])
        dx, dy = position[b, 0], position[b, 1]
        if a >= 0:
            dx -= position[a, 0]
            dy -= position[a, 1]
            gradient[a, 0] -= factor * dx
            gradient[a, 1] -= factor * dy
        if b < robots:
            gradient[b, 0] += factor * dx
            gradient[b, 1] += factor * dy
