"""Rigorous lower bounds on what a topology can cost, from one rollout at the reach of the controls.

The cost is convex and decreasing in the edge informations w. With w^R the information at the smallest distance
that two entities can reach by each step, min_u c_T(u) >= c_T(w^R), and the tangent at the current topology gives
c_T(w^R) >= c_T0(w^R) + sum_T B - sum_T0 B, B_ab = sum_i w^R_ab,i dc/dw_ab,i.
"""

import math

import numpy as np
from numba import njit, types

from groundstation.planning.planar.edges import exponentials
from groundstation.planning.planar.objective import weighted_cost
from groundstation.planning.planar.problem import PROBLEM, WORKSPACE
from groundstation.planning.planar.rollout import adjoint_columns

_f2, _f3, _f8, _i8 = types.float64[:, ::1], types.float64[:, :, ::1], types.float64, types.int64


@njit(types.void(PROBLEM, _f3), cache=True, nogil=True)
def reach_information(problem, reach):  # type: ignore[no-untyped-def]
    """Write w^R of every pair (h, n + 2, n + 2), upper triangle; index n + 1 is the global sensor."""
    constants, size = problem.constants, problem.mean.shape[0]
    exponent, out = np.empty(size + 1), np.empty(size + 1)
    for i in range(problem.steps):
        elapsed = (i + 1) * constants[4]
        step = elapsed * constants[6]
        for a in range(size):
            for b in range(a + 1, size + 1):
                dx, dy = -problem.mean[a, 0], -problem.mean[a, 1]
                if b < size:
                    dx += problem.mean[b, 0]
                    dy += problem.mean[b, 1]
                if b == size - 1:
                    dx += elapsed * constants[7]
                    dy += elapsed * constants[8]
                slack = 2.0 * step if b < size - 1 else step
                dx, dy = max(abs(dx) - slack, 0.0), max(abs(dy) - slack, 0.0)
                distance = math.sqrt(dx * dx + dy * dy + constants[3] * constants[3])
                exponent[b] = min((distance - constants[1]) / constants[2], 40.0)
            exponentials(exponent[a + 1 :], out[a + 1 :], size - a)
            for b in range(a + 1, size + 1):
                reach[i, a, b] = 1.0 / (constants[0] * constants[0] * (1.0 + out[b]))


@njit(types.void(_f3, _i8, WORKSPACE), cache=True, nogil=True)
def _load_reach(reach, count, work):  # type: ignore[no-untyped-def]
    sensor = reach.shape[1] - 1
    for e in range(count):
        a, b = work.edges[e, 0], work.edges[e, 1]
        low, high = (b, sensor) if a < 0 else (min(a, b), max(a, b))
        for i in range(reach.shape[0]):
            work.weights[i, e] = reach[i, low, high]


@njit(_f8(_f3, _i8, PROBLEM, WORKSPACE), cache=True, nogil=True)
def reach_bound(reach, count, problem, work):  # type: ignore[no-untyped-def]
    """Return c_T(w^R) for the workspace's edges: no admissible control can cost less."""
    _load_reach(reach, count, work)
    return weighted_cost(count, problem, work)


@njit(types.void(_f3, PROBLEM, WORKSPACE, _f2), cache=True, nogil=True, fastmath=True)
def pair_sensitivities(reach, problem, work, pairs):  # type: ignore[no-untyped-def]
    """Write B_ab (n + 2, n + 2; upper triangle) after `reach_bound` of the topology at the tangent point."""
    adjoint_columns(
        work.prior, work.factor, problem.constants[5], work.columns, work.carried, problem.addresses, work.integers
    )
    size = problem.mean.shape[0]
    pairs[:] = 0.0
    row = np.empty(size)
    for i in range(problem.steps):
        for a in range(size):
            row[:] = 0.0
            own = 0.0
            for c in range(problem.steps - i):
                y = work.columns[i, c]
                own += y[a] * y[a]
                for b in range(size):
                    row[b] += (y[b] - y[a]) ** 2
            for b in range(a + 1, size):
                pairs[a, b] -= reach[i, a, b] * row[b]
            pairs[a, size] -= reach[i, a, size] * own


@njit(_f8(_f2, _i8, WORKSPACE), cache=True, nogil=True)
def summed_sensitivity(pairs, count, work):  # type: ignore[no-untyped-def]
    """Return the sum of B over the workspace's edges."""
    total, sensor = 0.0, pairs.shape[0] - 1
    for e in range(count):
        a, b = work.edges[e, 0], work.edges[e, 1]
        total += pairs[b, sensor] if a < 0 else pairs[min(a, b), max(a, b)]
    return total
