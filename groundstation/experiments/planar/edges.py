"""Edges of a team sorted by level, and the information they carry at predicted positions.

Entities are sorted so that each level is contiguous (robots 0..n-1, target n): an observer's subjects are then a range
and every loop over them runs on contiguous memory. Row 0 is the global sensor at the origin, row a + 1
robot a. Ranges are unsigned: signed indices are tested for counting from the end, and nothing is vectorised.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from groundstation.arrays import IntVector, Matrix, Vector
from groundstation.experiments.planar.records import Observers, PlanarProblem, Workspace, X, Y
from groundstation.kernel import kernel
from groundstation.planning.lanes import LANES, MAGIC, Lanes, eights, in_lanes, index, nothing, repeated

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


class Edges(NamedTuple):
    """One observer's edges: place of the observer, subjects, first edge, and its position [m]; seen: 0 for the sensor.

    The global sensor has no place among the entities: it is given the first one, and nothing is added there.
    """

    place: int
    first: int
    end: int
    edge: int
    seen: float
    x: float
    y: float


@kernel(inlined=True)
def _edges(row: int, i: int, work: Workspace) -> Edges:
    """Return an observer's edges in step i."""
    observers, position, place, seen = work.observers, work.position, max(row - 1, 0), 1.0 if row > 0 else 0.0
    first, end = int(np.int64(observers.first[row])), int(np.int64(observers.end[row]))
    edge = int(np.int64(observers.edge[row]))
    return Edges(place, first, end, edge, seen, seen * position[i, X, place], seen * position[i, Y, place])


@in_lanes
def _place(b: Any, position: Any, square: Any, i: Any, edges: Any, more: Any) -> None:
    """Write the squared distances from an observer to its subjects, and `more`.

    The last eight reach into the next observer's edges, which are written after these.
    """

    def eight(k: Any, carried: list[Lanes]) -> list[Lanes]:
        done = b.mul(k, index(LANES))
        at = b.add(edges.first, done)
        dx, dy = position.read(i, index(X), at).minus(edges.x), position.read(i, index(Y), at).minus(edges.y)
        square.write(dx.squared().plus(dy.squared().plus(more)), i, b.add(edges.edge, done))
        return carried

    repeated(b, eights(b, edges.first, edges.end), [], eight)


class _Sensor(NamedTuple):
    range_m: float
    steepness: float
    weight: float
    tail: float


def _informed(tailed: bool) -> Callable[..., None]:
    """Return the writer of information and slope of a step's edges; `slope` holds their squared distances before."""

    def write(b: Any, slope: Any, information: Any, i: Any, count: Any, sensor: Any) -> None:
        reach, steepness, weight = sensor.range_m, sensor.steepness, sensor.weight

        def eight(k: Any, carried: list[Lanes]) -> list[Lanes]:
            edge = b.mul(k, index(LANES))
            square = slope.read(i, edge)
            near = square.inverse_root()
            exponent = square.times(near).minus(reach).times(steepness).within(-FARTHEST, FARTHEST)
            seen = exponent.exponential().plus(1.0).inverse()
            w = weight.times(seen)
            falling = w.times(seen.subtracted_from(1.0)).times(steepness).times(near)
            if tailed:
                far = reach.squared()
                beyond = square.plus(far).inverse()
                lasting = weight.times(sensor.tail).times(far).times(beyond)
                w, falling = w.plus(lasting), falling.plus(lasting.times(beyond).times(2.0))
            information.write(w, i, edge)
            slope.write(falling, i, edge)
            return carried

        repeated(b, eights(b, index(0), count), [], eight)

    return in_lanes(write)


_inform, _inform_with_tail = _informed(False), _informed(True)


@kernel()
def edge_information(i: int, problem: PlanarProblem, work: Workspace) -> None:
    """Write information w [1/m^2] and slope -dw/dd / d [1/m^4] of each edge in step i, d being its length.

    With v the tail's part of w: -dw/dd = (w - v) (1 - sigma^2 (w - v)) / s + 2 v d / (r^2 + d^2).
    """
    constants, observers, rows = problem.constants, work.observers, work.observers.edge.shape[0] - 1
    weight, rounding = 1.0 / (constants.sigma_m * constants.sigma_m), constants.epsilon_m * constants.epsilon_m
    sensor = _Sensor(constants.range_m, 1.0 / constants.softness_m, weight, constants.tail)
    for row in range(rows):
        _place(work.position, work.slopes, i, _edges(row, i, work), rounding)
    if constants.tail > 0.0:
        _inform_with_tail(work.slopes, work.weights, i, observers.edge[rows], sensor)
    else:
        _inform(work.slopes, work.weights, i, observers.edge[rows], sensor)


@in_lanes
def _spread(b: Any, matrix: Any, diagonal: Any, information: Any, i: Any, edges: Any) -> None:
    """Subtract the information of one observer's edges from its row, and add it to the diagonal of both ends."""

    def eight(k: Any, carried: list[Lanes]) -> list[Lanes]:
        done = b.mul(k, index(LANES))
        at = b.add(edges.first, done)
        w = information.read(i, b.add(edges.edge, done)).first(b.sub(edges.end, at))
        diagonal.write(diagonal.read(at).plus(w), at)
        w = w.times(edges.seen)
        matrix.write(matrix.read(edges.place, at).minus(w), edges.place, at)
        return [carried[0].plus(w)]

    (total,) = repeated(b, eights(b, edges.first, edges.end), [nothing(b)], eight)
    diagonal.add_one(total.sum(), edges.place)


@kernel()
def add_laplacian(matrix: Matrix, i: int, work: Workspace) -> None:
    """Add sum_e w_e a_e a_e^T of step i to the upper triangle; observers come before their subjects."""
    diagonal = work.scratch
    for a in range(diagonal.shape[0]):
        diagonal[a] = 0.0
    for row in range(work.observers.edge.shape[0] - 1):
        _spread(matrix, diagonal, work.weights, i, _edges(row, i, work))
    for a in range(matrix.shape[0]):
        matrix[a, a] += diagonal[a]


@in_lanes
def _pull(b: Any, columns: Any, slope: Any, position: Any, gradient: Any, i: Any, edges: Any, scale: Any) -> None:
    """Add one observer's edges to the gradient at both ends."""
    used = b.sub(columns.shape(0), i)

    def eight(k: Any, carried: list[Lanes]) -> list[Lanes]:
        done = b.mul(k, index(LANES))
        at = b.add(edges.first, done)

        def column(c: Any, sums: list[Lanes]) -> list[Lanes]:
            difference = columns.read(i, c, at).minus(columns.one(i, c, edges.place).times(edges.seen))
            return [difference.squared().plus(sums[0])]

        sensitivity = repeated(b, used, [nothing(b)], column)[0].times(scale)
        factor = sensitivity.times(slope.read(i, b.add(edges.edge, done))).first(b.sub(edges.end, at))
        totals = []
        for axis, own, total in zip((X, Y), (edges.x, edges.y), carried, strict=True):
            force = factor.times(position.read(i, index(axis), at).minus(own))
            gradient.write(gradient.read(i, index(axis), at).plus(force), i, index(axis), at)
            totals.append(total.minus(force.times(edges.seen)))
        return totals

    totals = repeated(b, eights(b, edges.first, edges.end), [nothing(b)] * 2, eight)
    for axis, total in zip((X, Y), totals, strict=True):
        gradient.add_one(total.sum(), i, index(axis), edges.place)


@kernel()
def position_gradient(i: int, problem: PlanarProblem, work: Workspace) -> None:
    """Write dc/dposition of step i (2, m): dc/dw = -sum_c (Y[c, b] - Y[c, a])^2."""
    gradient, scale = work.gradient, problem.constants.step_s * problem.constants.max_speed_m_s
    gradient[i, :, :] = 0.0
    for row in range(work.observers.edge.shape[0] - 1):
        _pull(work.columns, work.slopes, work.position, gradient, i, _edges(row, i, work), scale)
