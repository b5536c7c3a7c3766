"""Covariance rollout in information form, and its adjoint.

Per axis the joint covariance is an (n + 1, n + 1) matrix P (isotropic sensors), target last, then padding. With
D = Q^-1: L_i = Lm_i + Laplacian(w_i), Lm_{i+1} = D - D (L_i + D)^-1 D, cost = sum_i 2 gamma^i / chol(L_i)[t, t]^2.
"""

import numpy as np

from groundstation.arrays import Matrix, MatrixStack, Vector
from groundstation.experiments.planar.edges import add_laplacian
from groundstation.experiments.planar.records import PlanarProblem, Workspace
from groundstation.kernel import kernel
from groundstation.planning.dense import copy_upper, subtract_products
from groundstation.planning.elimination import eliminate, eliminate_and_invert, negative_inverse, solve_for_columns


@kernel()
def predicted_information(covariance: Matrix, variance: Vector, out: Matrix, panel: Matrix) -> bool:
    """Write (P + Q)^-1 into `out` (m, m), identity in the padding; False when P + Q is not positive definite."""
    size = covariance.shape[0]
    out[:, :] = 0.0
    for a in range(out.shape[0]):
        out[a, a] = -1.0
    for a in range(size):
        for b in range(size):
            out[a, b] = covariance[a, b]
        out[a, a] += variance[a]
    for a in range(size, out.shape[0]):
        out[a, a] = 1.0
    if not negative_inverse(out, panel):
        return False
    for a in range(size):
        for b in range(a, size):
            out[a, b] = -out[a, b]
            out[b, a] = out[a, b]
    return True


@kernel(contract=True)
def _predict(prior: MatrixStack, i: int, variance: Vector, size: int, square: Matrix, panel: Matrix) -> None:
    """Write Lm_{i+1} from -(L_i + D)^-1, which stands in `square`."""
    for b in range(size):
        panel[0, b] = 1.0 / variance[b]
    for a in range(size):
        da = panel[0, a]
        for b in range(np.uint64(a & ~7), np.uint64(size)):
            prior[i + 1, a, b] = da * square[a, b] * panel[0, b]
        prior[i + 1, a, a] += da


@kernel()
def _predict_through_covariance(
    prior: MatrixStack, i: int, variance: Vector, size: int, square: Matrix, panel: Matrix
) -> bool:
    """Do the same as (L_i^-1 + Q)^-1.

    The short form loses digits when the process noise is tiny against P: eps * max(D P).
    """
    if not negative_inverse(square, panel):
        return False
    for a in range(size):
        for b in range(a, size):
            square[a, b] = -square[a, b]
        square[a, a] += variance[a]
    for a in range(size, square.shape[0]):
        square[a, a] = 1.0
    if not negative_inverse(square, panel):
        return False
    for a in range(size):
        for b in range(a, size):
            prior[i + 1, a, b] = -square[a, b]
    return True


@kernel()
def _copy(source: MatrixStack, i: int, target: MatrixStack) -> None:
    """Copy the upper triangle of one matrix of a stack."""
    m = np.uint64(source.shape[1])
    for a in range(source.shape[1]):
        for b in range(np.uint64(a & ~7), m):
            target[i, a, b] = source[i, a, b]


@kernel()
def _copy_one(source: MatrixStack, i: int, target: Matrix) -> None:
    m = np.uint64(source.shape[1])
    for a in range(source.shape[1]):
        for b in range(np.uint64(a & ~7), m):
            target[a, b] = source[i, a, b]


@kernel()
def rollout_cost(problem: PlanarProblem, work: Workspace) -> float:
    """Return the discounted trace of the target's covariance [m^2] for the edge informations in the workspace.

    -1 when a matrix is not positive definite. prior[0] holds Lm_1; prior and factor are filled for the adjoint (upper
    triangles).
    """
    prior, factor, variance, square, panel = work.prior, work.factor, work.variance, work.square, work.panel
    discount = problem.constants.discount
    steps, size = prior.shape[0], variance.shape[0]
    target = size - 1
    cost, weight = 0.0, 1.0
    for i in range(steps):
        _copy(prior, i, factor)
        add_laplacian(factor[i], i, work)
        if i + 1 == steps:
            sound = eliminate(factor[i], panel)
        elif problem.stable:
            _copy_one(factor, i, square)
            sound = eliminate(factor[i], panel) and _predict_through_covariance(prior, i, variance, size, square, panel)
        else:
            _copy_one(factor, i, square)
            for a in range(size):
                square[a, a] += 1.0 / variance[a]
            sound = eliminate_and_invert(factor[i], square, panel)
            _predict(prior, i, variance, size, square, panel)
        if not sound:
            return -1.0
        weight *= discount
        cost += 2.0 * weight * factor[i, target, target]
    return cost


@kernel(contract=True, reassociate=True)
def adjoint_columns(discount: float, work: Workspace) -> None:
    """Write the rank-one adjoints: columns[i, 0..h-1-i] = Y_i, so that dc/dw_ab,i = -sum_c (Y[c, b] - Y[c, a])^2.

    Each step adds L_i^-1 e_t, weighted; older columns go from step i to i - 1 by L_{i-1}^-1 Lm_i = 1 - Q Lm_i, which is
    cheaper than a solve and needs nothing but Lm_i.
    """
    prior, factor, variance, columns = work.prior, work.factor, work.variance, work.columns
    steps, target = prior.shape[0], variance.shape[0] - 1
    solve_for_columns(factor, columns, target)
    for i in range(steps - 1, -1, -1):
        own, weight = steps - 1 - i, np.sqrt(2.0 * discount ** (i + 1))
        if i + 1 < steps:
            copy_upper(prior[i + 1])
            columns[i, :own, :] = 0.0
            subtract_products(columns[i], prior[i + 1], columns[i + 1], own)
            for c in range(own):
                for a in range(target + 1):
                    columns[i, c, a] = columns[i + 1, c, a] + variance[a] * columns[i, c, a]
        for a in range(target + 1):
            columns[i, own, a] *= weight
