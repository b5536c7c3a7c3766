"""Rigorous lower bounds on what a topology can cost, from one rollout at the reach of the controls.

The cost is convex and decreasing in the edge informations w. With w^R the information at the smallest distance
that two entities can reach by each step, min_u c_T(u) >= c_T(w^R), and the tangent at the current topology gives
c_T(w^R) >= c_T0(w^R) + sum_T B - sum_T0 B, B_ab = sum_i w^R_ab,i dc/dw_ab,i.
"""

import math

import numpy as np
from numba import njit, types

from groundstation.experiments.planar.edges import exponentials, sort_team
from groundstation.experiments.planar.objective import weighted_cost
from groundstation.experiments.planar.problem import PROBLEM, WORKSPACE, load_topology
from groundstation.experiments.planar.rollout import adjoint_columns

_f1, _f2, _f3, _f8 = types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1], types.float64
_i1, _i2, _i8 = types.int64[::1], types.int64[:, ::1], types.int64


@njit(types.void(PROBLEM, _f3), cache=True, nogil=True, error_model="numpy")
def reach_information(problem, reach):  # type: ignore[no-untyped-def]
    """Write w^R of every pair (h, n + 2, n + 2), symmetric; index n + 1 is the global sensor."""
    constants, size = problem.constants, problem.mean.shape[0]
    exponent, out, far = np.empty(size + 1), np.empty(size + 1), np.empty(size + 1)
    x, y, slack = np.zeros(size + 1), np.zeros(size + 1), np.zeros(size + 1)
    square, weight = constants[1] * constants[1], 1.0 / (constants[0] * constants[0])
    for i in range(problem.steps):
        elapsed = (i + 1) * constants[4]
        for a in range(size):
            x[a], y[a], slack[a] = problem.mean[a, 0], problem.mean[a, 1], elapsed * constants[6]
        x[size - 1] += elapsed * constants[7]
        y[size - 1] += elapsed * constants[8]
        slack[size - 1] = 0.0
        for a in range(size + 1):
            for b in range(a + 1):
                free = slack[a] + slack[b]
                dx, dy = max(abs(x[b] - x[a]) - free, 0.0), max(abs(y[b] - y[a]) - free, 0.0)
                distance = math.sqrt(dx * dx + dy * dy + constants[3] * constants[3])
                exponent[b] = min((distance - constants[1]) / constants[2], 40.0)
                far[b] = constants[9] * square / (square + distance * distance)
            exponentials(exponent, out, a + 1)
            for b in range(a + 1):
                reach[i, a, b] = weight * (1.0 / (1.0 + out[b]) + far[b])
                reach[i, b, a] = reach[i, a, b]


@njit(_f8(_i1, _f3, PROBLEM, WORKSPACE), cache=True, nogil=True)
def reach_bound(level, reach, problem, work):  # type: ignore[no-untyped-def]
    """Return c_T(w^R): no admissible control can cost less. Leaves the topology in the workspace."""
    load_topology(level, problem, work)
    sensor = reach.shape[1] - 1
    for row in range(work.order.shape[0]):
        observer = work.order[row - 1] if row > 0 else sensor
        shift = work.rows[row, 2] - work.rows[row, 0]
        for b in range(work.rows[row, 0], work.rows[row, 1]):
            subject = work.order[b]
            for i in range(reach.shape[0]):
                work.weights[i, b + shift] = reach[i, observer, subject]
    return weighted_cost(problem, work)


@njit(types.void(_f3, PROBLEM, WORKSPACE, _f2), cache=True, nogil=True, fastmath={"contract", "reassoc"})
def pair_sensitivities(reach, problem, work, pairs):  # type: ignore[no-untyped-def]
    """Write B_ab (n + 2, n + 2; symmetric) after `reach_bound` of the topology at the tangent point."""
    adjoint_columns(work.prior, work.factor, work.variance, problem.constants[5], work.columns)
    size = problem.mean.shape[0]
    y, row = np.zeros((problem.steps, size + 1)), np.empty(size + 1)
    pairs[:, :] = 0.0
    for i in range(problem.steps):
        used = problem.steps - i
        for c in range(used):
            for a in range(size):
                y[c, work.order[a]] = work.columns[i, c, a]
        for a in range(size + 1):
            for b in range(a + 1):
                row[b] = 0.0
            for c in range(used):
                own = y[c, a]
                for b in range(a + 1):
                    row[b] += (y[c, b] - own) * (y[c, b] - own)
            for b in range(a + 1):
                pairs[a, b] -= reach[i, a, b] * row[b]
    for a in range(size + 1):
        for b in range(a):
            pairs[b, a] = pairs[a, b]


@njit(_f8(_i1, _f2, WORKSPACE), cache=True, nogil=True)
def summed_sensitivity(level, pairs, work):  # type: ignore[no-untyped-def]
    """Return the sum of B over a topology's edges."""
    sort_team(level, work.order, work.rows)
    total, sensor = 0.0, pairs.shape[0] - 1
    for row in range(work.order.shape[0]):
        observer = work.order[row - 1] if row > 0 else sensor
        for b in range(work.rows[row, 0], work.rows[row, 1]):
            total += pairs[observer, work.order[b]]
    return total


@njit(types.void(_i2, _i8, _f3, PROBLEM, WORKSPACE, _f1), cache=True, nogil=True)
def tangent_bounds(levels, total, reach, problem, work, bounds):  # type: ignore[no-untyped-def]
    """Write the reach bound of levels[0] and the tangent bounds of levels[1..total - 1] [m^2]."""
    size = problem.mean.shape[0]
    pairs = np.empty((size + 1, size + 1))
    bounds[0] = reach_bound(levels[0], reach, problem, work)
    pair_sensitivities(reach, problem, work, pairs)
    base = bounds[0] - summed_sensitivity(levels[0], pairs, work)
    for t in range(1, total):
        bounds[t] = base + summed_sensitivity(levels[t], pairs, work)
