"""Edges of a team sorted by level, and the information they carry at predicted positions.

Entities are sorted so that each level is contiguous (robots 0..n-1, target n): an observer's subjects are then a range
and every loop over them runs on contiguous memory. Row 0 is the global sensor at the origin, row a + 1
robot a. Ranges are unsigned: signed indices are tested for counting from the end, and nothing is vectorised.
"""

import math

import numpy as np

from groundstation.arrays import IntVector, Matrix, Vector
from groundstation.experiments.planar.records import Observers, PlanarProblem, Workspace, X, Y
from groundstation.kernel import kernel

MAGIC = 6755399441055744.0  # 1.5 * 2^52: adding it leaves the nearest integer in the low bits of a float64
FARTHEST = 40.0  # exponent beyond which a reading carries no information; below its negative, all


@kernel()
def sort_team(level: IntVector, order: IntVector, observers: Observers) -> None:
    """Write the entities sorted by level into `order` (n + 1), and each observer's subjects."""
    first, end, edge = observers.first, observers.end, observers.edge
    n = level.shape[0]
    start = np.zeros(n + 2, np.int64)
    last = 0
    edge[0] = 0
    for robot in range(n):
        start[level[robot] + 1] += 1
        last = max(last, int(level[robot]))
    for k in range(last + 1):
        start[k + 1] += start[k]
    first[0], end[0] = 0, start[1]
    for k in range(last + 1):
        for a in range(start[k], start[k + 1]):
            first[a + 1] = start[k + 1]
            end[a + 1] = start[k + 2] if k < last else n + 1
    for robot in range(n):
        order[start[level[robot]]] = robot
        start[level[robot]] += 1
    order[n] = n
    for row in range(n + 1):
        edge[row + 1] = edge[row] + end[row] - first[row]


@kernel()
def exponentials(x: Vector, out: Vector, count: int) -> None:
    """Write exp(x) for |x| <= 700 to within 2 ulp, in a form the compiler vectorises (math.exp is a call each).

    `x` is overwritten. No fastmath here: reassociation would cancel the rounding by MAGIC.
    """
    bits = out.view(np.int64)
    for e in range(count):
        out[e] = x[e] * 1.4426950408889634 + MAGIC
    for e in range(count):
        k = out[e] - MAGIC
        r = (x[e] - k * 0.693147180369123816490) - k * 1.90821492927058770002e-10
        tail = 1 / 40320 + r * (1 / 362880 + r * (1 / 3628800 + r * (1 / 39916800 + r * (1 / 479001600))))
        series = 1 / 24 + r * (1 / 120 + r * (1 / 720 + r * (1 / 5040 + r * tail)))
        x[e] = 1.0 + r * (1.0 + r * (0.5 + r * (1 / 6 + r * series)))
        bits[e] = (bits[e] + 1023) << 52
    for e in range(count):
        out[e] *= x[e]


@kernel(contract=True)
def edge_information(i: int, problem: PlanarProblem, work: Workspace) -> None:
    """Write step i's distance d [m] and information w [1/m^2] of each edge."""
    constants, observers = problem.constants, work.observers
    position, distance, information, exponent = work.position, work.distance, work.weights, work.scratch
    sigma, reach, epsilon, tail = constants.sigma_m, constants.range_m, constants.epsilon_m, constants.tail
    steepness, rounding = 1.0 / constants.softness_m, epsilon * epsilon
    rows = observers.edge.shape[0] - 1
    count = observers.edge[rows]
    for row in range(rows):
        x = position[i, X, row - 1] if row > 0 else 0.0
        y = position[i, Y, row - 1] if row > 0 else 0.0
        first, end, shift = observers.first[row], observers.end[row], observers.edge[row] - observers.first[row]
        for b in range(first, end):
            dx, dy = position[i, X, b] - x, position[i, Y, b] - y
            distance[i, b + shift] = dx * dx + dy * dy
    for e in range(count):
        d = math.sqrt(distance[i, e] + rounding)
        distance[i, e] = d
        exponent[e] = min(max((d - reach) * steepness, -FARTHEST), FARTHEST)
    exponentials(exponent, information[i], int(np.int64(count)))
    weight, square = 1.0 / (sigma * sigma), reach * reach
    for e in range(count):
        information[i, e] = weight / (1.0 + information[i, e])
    if tail > 0.0:
        for e in range(count):
            d = distance[i, e]
            information[i, e] += weight * tail * square / (square + d * d)


@kernel(contract=True, reassociate=True)
def add_laplacian(matrix: Matrix, observers: Observers, information: Matrix, i: int) -> None:
    """Add sum_e w_e a_e a_e^T of step i to the upper triangle; observers come before their subjects."""
    for row in range(observers.edge.shape[0] - 1):
        first, end, shift = observers.first[row], observers.end[row], observers.edge[row] - observers.first[row]
        for b in range(first, end):
            matrix[b, b] += information[i, b + shift]
        if row > 0:
            total = 0.0
            for b in range(first, end):
                total += information[i, b + shift]
                matrix[row - 1, b] -= information[i, b + shift]
            matrix[row - 1, row - 1] += total


@kernel(contract=True, reassociate=True)
def position_gradient(i: int, problem: PlanarProblem, work: Workspace) -> None:
    """Write dc/dposition of step i (2, m): dc/dw = -sum_c (Y[c, b] - Y[c, a])^2.

    With v the tail's part of w: dw/dd = -(w - v) (1 - sigma^2 (w - v)) / s - 2 v d / (r^2 + d^2).
    """
    constants, observers, gradient, columns = problem.constants, work.observers, work.gradient, work.columns
    position, distance, information, slope = work.position, work.distance, work.weights, work.scratch
    sigma2, steepness = constants.sigma_m * constants.sigma_m, 1.0 / constants.softness_m
    square, scale = constants.range_m * constants.range_m, constants.step_s * constants.max_speed_m_s
    tail = constants.tail * square / sigma2
    used = position.shape[0] - i
    gradient[i, :, :] = 0.0
    for row in range(observers.edge.shape[0] - 1):
        first, end, shift = observers.first[row], observers.end[row], observers.edge[row] - observers.first[row]
        x, y = 0.0, 0.0
        if row > 0:
            x, y = position[i, X, row - 1], position[i, Y, row - 1]
        # Two columns at a time, the odd one first: levels are short, and each loop over one costs its start.
        odd = used % 2
        for b in range(first, end):
            difference = columns[i, 0, b] - (columns[i, 0, row - 1] if row > 0 else 0.0)
            slope[b] = odd * difference * difference
        for c in range(odd, used, 2):
            own = columns[i, c, row - 1] if row > 0 else 0.0
            other = columns[i, c + 1, row - 1] if row > 0 else 0.0
            for b in range(first, end):
                difference = columns[i, c, b] - own
                slope[b] += difference * difference + (columns[i, c + 1, b] - other) * (columns[i, c + 1, b] - other)
        sum_x, sum_y = 0.0, 0.0
        if tail > 0.0:
            for b in range(first, end):
                d = distance[i, b + shift]
                beyond = 1.0 / (square + d * d)
                w = information[i, b + shift] - tail * beyond
                slope[b] *= w * (1.0 - sigma2 * w) * steepness / d + 2.0 * tail * beyond * beyond
        else:
            for b in range(first, end):
                w = information[i, b + shift]
                slope[b] *= w * (1.0 - sigma2 * w) * steepness / distance[i, b + shift]
        for b in range(first, end):
            factor = scale * slope[b]
            fx, fy = factor * (position[i, X, b] - x), factor * (position[i, Y, b] - y)
            gradient[i, X, b] += fx
            gradient[i, Y, b] += fy
            sum_x += fx
            sum_y += fy
        if row > 0:
            gradient[i, X, row - 1] -= sum_x
            gradient[i, Y, row - 1] -= sum_y
