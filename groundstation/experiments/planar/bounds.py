"""Rigorous lower bounds on a topology's cost, from one rollout at the reach of the controls.

The cost is convex and decreasing in the edge informations w. With w^R the information at the smallest distance
that two entities can reach by each step, min_u c_T(u) >= c_T(w^R), and the tangent at the current topology gives
c_T(w^R) >= c_T0(w^R) + sum_T B - sum_T0 B, B_ab = sum_i w^R_ab,i dc/dw_ab,i.
"""

import math

import numpy as np

from groundstation.arrays import IntMatrix, IntVector, Matrix, MatrixStack, Vector
from groundstation.experiments.planar.edges import FARTHEST, exponentials, sort_team
from groundstation.experiments.planar.problem import load_topology
from groundstation.experiments.planar.records import PlanarProblem, Workspace, X, Y
from groundstation.experiments.planar.rollout import adjoint_columns, rollout_cost
from groundstation.kernel import kernel


@kernel()
def reach_information(problem: PlanarProblem, reach: MatrixStack) -> None:
    """Write w^R of every pair (h, n + 2, n + 2), symmetric; index n + 1 is the global sensor."""
    constants, mean, size = problem.constants, problem.mean, problem.mean.shape[0]
    exponent, out, far = np.empty(size + 1), np.empty(size + 1), np.empty(size + 1)
    x, y, slack = np.zeros(size + 1), np.zeros(size + 1), np.zeros(size + 1)
    square, weight = constants.range_m * constants.range_m, 1.0 / (constants.sigma_m * constants.sigma_m)
    for i in range(problem.steps):
        elapsed = (i + 1) * constants.step_s
        for a in range(size):
            x[a], y[a], slack[a] = mean[a, X], mean[a, Y], elapsed * constants.max_speed_m_s
        x[size - 1] += elapsed * constants.target_velocity_x
        y[size - 1] += elapsed * constants.target_velocity_y
        slack[size - 1] = 0.0
        for a in range(size + 1):
            for b in range(a + 1):
                free = slack[a] + slack[b]
                dx, dy = max(abs(x[b] - x[a]) - free, 0.0), max(abs(y[b] - y[a]) - free, 0.0)
                distance = math.sqrt(dx * dx + dy * dy + constants.epsilon_m * constants.epsilon_m)
                exponent[b] = min(max((distance - constants.range_m) / constants.softness_m, -FARTHEST), FARTHEST)
                far[b] = constants.tail * square / (square + distance * distance)
            exponentials(exponent, out, a + 1)
            for b in range(a + 1):
                reach[i, a, b] = weight * (1.0 / (1.0 + out[b]) + far[b])
                reach[i, b, a] = reach[i, a, b]


@kernel()
def reach_bound(level: IntVector, reach: MatrixStack, problem: PlanarProblem, work: Workspace) -> float:
    """Return c_T(w^R): no admissible control can cost less. Leaves the topology in the workspace."""
    load_topology(level, problem, work)
    sensor, order, observers, weights = reach.shape[1] - 1, work.order, work.observers, work.weights
    for row in range(order.shape[0]):
        observer = order[row - 1] if row > 0 else sensor
        shift = observers.edge[row] - observers.first[row]
        for b in range(observers.first[row], observers.end[row]):
            subject = order[b]
            for i in range(reach.shape[0]):
                weights[i, b + shift] = reach[i, observer, subject]
    return rollout_cost(problem, work)


@kernel(contract=True, reassociate=True)
def pair_sensitivities(reach: MatrixStack, problem: PlanarProblem, work: Workspace, pairs: Matrix) -> None:
    """Write B_ab (n + 2, n + 2; symmetric) after `reach_bound` of the topology at the tangent point."""
    adjoint_columns(problem.constants.discount, work)
    size, order, columns = problem.mean.shape[0], work.order, work.columns
    y, row = np.zeros((problem.steps, size + 1)), np.empty(size + 1)
    pairs[:, :] = 0.0
    for i in range(problem.steps):
        used = problem.steps - i
        for c in range(used):
            for a in range(size):
                y[c, order[a]] = columns[i, c, a]
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


@kernel()
def summed_sensitivity(level: IntVector, pairs: Matrix, work: Workspace) -> float:
    """Return the sum of B over a topology's edges."""
    order, observers, sensor, total = work.order, work.observers, pairs.shape[0] - 1, 0.0
    sort_team(level, order, observers)
    for row in range(order.shape[0]):
        observer = order[row - 1] if row > 0 else sensor
        for b in range(observers.first[row], observers.end[row]):
            total += pairs[observer, order[b]]
    return total


@kernel()
def tangent_bounds(
    levels: IntMatrix, reach: MatrixStack, problem: PlanarProblem, work: Workspace, bounds: Vector
) -> None:
    """Write the reach bound of levels[0] and the tangent bounds of all others [m^2]."""
    size = problem.mean.shape[0]
    pairs = np.empty((size + 1, size + 1))
    bounds[0] = reach_bound(levels[0], reach, problem, work)
    pair_sensitivities(reach, problem, work, pairs)
    base = bounds[0] - summed_sensitivity(levels[0], pairs, work)
    for t in range(1, levels.shape[0]):
        bounds[t] = base + summed_sensitivity(levels[t], pairs, work)
