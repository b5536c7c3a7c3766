"""Cost of a topology with one robot moved, at the current topology's optimum, from the current one's adjoint.

The cost is sum_k max_y (2 e_k^T y - y^T M_k y), M_k the smoothing information of the steps up to k, and y = M_k^-1 e_k
are the adjoint's columns. A moved robot changes its own edges: its entries of y are found anew, all others stay. The
result is never above the cost there, and the difference is quadratic in the neglected change of the other entries.
"""

import math
from typing import NamedTuple

import numpy as np

from groundstation.arrays import IntVector, Matrix, Vector
from groundstation.experiments.planar.edges import FARTHEST, exponentials
from groundstation.experiments.planar.objective import cost_and_gradient
from groundstation.experiments.planar.problem import load_topology, reorder
from groundstation.experiments.planar.records import Optimum, PlanarProblem, Workspace, X, Y
from groundstation.kernel import kernel


class Links(NamedTuple):
    """Between one robot and all entities (h, n + 2): distance [m], information [1/m^2], pull per metre [1].

    before, after (n + 2): 1 where the robot has an edge in the current topology, and where it is moved to.
    own (h, h): the robot's entries of the columns once it is moved.
    """

    before: Vector
    after: Vector
    distance: Matrix
    information: Matrix
    pull: Matrix
    own: Matrix


@kernel()
def optimum_of(level: IntVector, controls: Vector, steps: int) -> Optimum:
    """Return room for a topology at its optimum."""
    count = level.shape[0] + 2
    return Optimum(
        level,
        controls,
        np.empty(controls.shape[0]),
        np.zeros((steps, 2, count)),
        np.zeros((steps, steps, count)),
        np.zeros((steps, count)),
    )


@kernel()
def evaluate(level: IntVector, controls: Vector, problem: PlanarProblem, work: Workspace, gradient: Vector) -> None:
    """Write the gradient of a topology's cost; both by entity."""
    x, sorted_gradient, robots = np.empty(controls.shape[0]), np.empty(controls.shape[0]), level.shape[0]
    load_topology(level, problem, work)
    reorder(controls, robots, work, x, True)
    cost_and_gradient(x, problem, work, sorted_gradient)
    reorder(sorted_gradient, robots, work, gradient, False)


@kernel()
def _hold(i: int, at: Optimum, problem: PlanarProblem, work: Workspace) -> None:
    """Write each entity's diagonal information at step i: of its belief, the neighbouring steps, and its edges."""
    held, order, observers, sensor = at.held, work.order, work.observers, at.level.shape[0] + 1
    for a in range(order.shape[0]):
        stiffness = 1.0 / problem.variance[a]
        held[i, a] = stiffness + (problem.information[a, a] if i == 0 else stiffness)
    held[i, sensor] = np.inf
    for row in range(order.shape[0]):
        observer, shift = order[row - 1] if row > 0 else sensor, observers.edge[row] - observers.first[row]
        for b in range(observers.first[row], observers.end[row]):
            held[i, observer] += work.weights[i, b + shift]
            held[i, order[b]] += work.weights[i, b + shift]


@kernel()
def look(at: Optimum, problem: PlanarProblem, work: Workspace) -> None:
    """Fill in an optimum, with one evaluation of its cost."""
    position, columns = at.position, at.columns
    evaluate(at.level, at.controls, problem, work, at.gradient)
    for i in range(problem.steps):
        for a in range(at.level.shape[0] + 1):
            own = work.order[a]
            position[i, X, own], position[i, Y, own] = work.position[i, X, a], work.position[i, Y, a]
            for c in range(problem.steps - i):
                columns[i, c, own] = work.columns[i, c, a]
        _hold(i, at, problem, work)


@kernel()
def moved_robot(before: IntVector, after: IntVector) -> int:
    """Return the only robot whose edges differ between two topologies, or -1."""
    moved, last, last_after = -1, 0, 0
    for a in range(before.shape[0]):
        last, last_after = max(last, before[a]), max(last_after, after[a])
        if before[a] != after[a]:
            if moved >= 0:
                return -1
            moved = a
    return moved if last == last_after else -1


@kernel()
def _mark(level: IntVector, robot: int, own: int, last: int, edges: Vector) -> None:
    """Write 1 for each entity that a robot on level `own` shares an edge with, else 0."""
    n = level.shape[0]
    for b in range(n):
        edges[b] = 1.0 if b != robot and abs(level[b] - own) == 1 else 0.0
    edges[n], edges[n + 1] = 1.0 if own == last else 0.0, 1.0 if own == 0 else 0.0


@kernel(contract=True)
def _links(robot: int, to: int, at: Optimum, problem: PlanarProblem) -> Links:
    """Return a robot's links, with distance and information at the optimum."""
    constants, steps, count, last = problem.constants, problem.steps, at.level.shape[0] + 2, 0
    links = Links(
        np.empty(count), np.empty(count), np.empty((steps, count)), np.empty((steps, count)), np.empty((steps, count)),
        np.empty((steps, steps)),
    )  # fmt: skip
    for own in at.level:
        last = max(last, own)
    _mark(at.level, robot, int(at.level[robot]), last, links.before)
    _mark(at.level, robot, to, last, links.after)
    distance, information, exponent = links.distance, links.information, np.empty(count)
    weight, square = 1.0 / (constants.sigma_m * constants.sigma_m), constants.range_m * constants.range_m
    for i in range(steps):
        for b in range(count):
            dx = at.position[i, X, b] - at.position[i, X, robot]
            dy = at.position[i, Y, b] - at.position[i, Y, robot]
            distance[i, b] = math.sqrt(dx * dx + dy * dy + constants.epsilon_m * constants.epsilon_m)
            x = (distance[i, b] - constants.range_m) / constants.softness_m
            exponent[b] = min(max(x, -FARTHEST), FARTHEST)
        exponentials(exponent, information[i], count)
        for b in range(count):
            tail = constants.tail * square / (square + distance[i, b] * distance[i, b])
            information[i, b] = weight * (1.0 / (1.0 + information[i, b]) + tail)
    return links


@kernel(contract=True, reassociate=True)
def _moved_cost(robot: int, cost: float, at: Optimum, links: Links, problem: PlanarProblem) -> float:
    """Return the cost once the robot is moved, from the current topology's; writes its own entries of the columns."""
    steps, count, stiffness = problem.steps, at.level.shape[0] + 2, 1.0 / problem.variance[robot]
    before, after, information = links.before, links.after, links.information
    row, right, diagonal = problem.information[robot], np.empty(steps), np.empty(steps)
    total = cost
    for c in range(steps):
        used = steps - c
        for i in range(used):
            y = at.columns[i, c]
            met = left = gained = lost = 0.0
            for b in range(count):
                w, own = information[i, b], y[b]
                gained += after[b] * w
                met += after[b] * w * own
                left += before[b] * w * own
                lost += (before[b] - after[b]) * w * own * own
            diagonal[i], right[i] = gained + (stiffness if i + 1 < used else 0.0) + (stiffness if i > 0 else 0.0), met
            if i == 0:
                coupling = 0.0
                for b in range(count - 1):
                    coupling += row[b] * y[b]
                coupling -= row[robot] * y[robot]
                diagonal[0] += row[robot]
                right[0] -= coupling
                left -= coupling
            total += lost - left * y[robot]
        # There remains the minimum of a quadratic form in the robot's own entries that couples neighbouring steps only.
        for i in range(1, used):
            factor = stiffness / diagonal[i - 1]
            diagonal[i] -= factor * stiffness
            right[i] += factor * right[i - 1]
        for i in range(used - 1, -1, -1):
            total += right[i] * right[i] / diagonal[i]
            further = stiffness * links.own[i + 1, c] if i + 1 < used else 0.0
            links.own[i, c] = (right[i] + further) / diagonal[i]
    return float(total)


@kernel(contract=True, reassociate=True)
def _pull(
    robot: int, at: Optimum, links: Links, problem: PlanarProblem, own: Matrix, edges: Vector, sign: float
) -> None:
    """Add to each entity's pull the share of its edge with the robot in dc/dposition, per metre of their difference."""
    constants, steps, count = problem.constants, problem.steps, at.level.shape[0] + 2
    sigma2, square = constants.sigma_m * constants.sigma_m, constants.range_m * constants.range_m
    steepness, tail, slope = 1.0 / constants.softness_m, constants.tail * square / sigma2, np.empty(count)
    for i in range(steps):
        for b in range(count):
            slope[b] = 0.0
        for c in range(steps - i):
            for b in range(count):
                difference = at.columns[i, c, b] - own[i, c]
                slope[b] += difference * difference
        for b in range(count):
            d = links.distance[i, b]
            beyond = 1.0 / (square + d * d)
            w = links.information[i, b] - tail * beyond
            factor = w * (1.0 - sigma2 * w) * steepness / d + 2.0 * tail * beyond * beyond
            links.pull[i, b] += sign * edges[b] * slope[b] * factor


@kernel(contract=True)
def _moved_gradient(robot: int, at: Optimum, links: Links, problem: PlanarProblem, gradient: Vector) -> None:
    """Write the gradient in the scaled controls once the robot is moved."""
    constants, steps, robots = problem.constants, problem.steps, at.level.shape[0]
    scale = constants.step_s * constants.max_speed_m_s
    former = np.empty((steps, steps))
    for i in range(steps):
        for c in range(steps - i):
            former[i, c] = at.columns[i, c, robot]
    links.pull[:, :] = 0.0
    _pull(robot, at, links, problem, former, links.before, -1.0)
    _pull(robot, at, links, problem, links.own, links.after, 1.0)
    for k in range(gradient.shape[0]):
        gradient[k] = at.gradient[k]
    for axis in range(2):
        for b in range(robots + 2):
            total = 0.0
            for i in range(steps - 1, -1, -1):
                force = scale * links.pull[i, b] * (at.position[i, axis, b] - at.position[i, axis, robot])
                total += force
                offset = (i * problem.segments // steps) * robots * 2 + axis
                if b < robots:
                    gradient[offset + 2 * b] += total
                gradient[offset + 2 * robot] -= total


@kernel(contract=True, reassociate=True)
def _imbalance(robot: int, at: Optimum, links: Links) -> float:
    """Return by how much the cost would grow if the others' entries followed, each for itself [m^2]."""
    before, after, total = links.before, links.after, 0.0
    for i in range(links.own.shape[0]):
        for c in range(links.own.shape[0] - i):
            y, former, own = at.columns[i, c], at.columns[i, c, robot], links.own[i, c]
            for b in range(before.shape[0]):
                force = links.information[i, b] * (after[b] * (y[b] - own) - before[b] * (y[b] - former))
                total += force * force / at.held[i, b]
    return total


@kernel()
def moved_cost(
    to: IntVector, at: Optimum, cost: float, problem: PlanarProblem, gradient: Vector
) -> tuple[float, float]:
    """Return a lower bound of a topology's cost at the current one's optimum [m^2], and write its gradient there.

    cost: the current topology's there. The second number grows with the gap of the bound. `to` moves one robot.
    """
    robot = moved_robot(at.level, to)
    links = _links(robot, int(to[robot]), at, problem)
    value = _moved_cost(robot, cost, at, links, problem)
    _moved_gradient(robot, at, links, problem, gradient)
    return value, _imbalance(robot, at, links)
