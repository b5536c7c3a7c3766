"""A lower bound of the cost over all topologies and all admissible controls at once; compiled."""

import math

import numpy as np

from groundstation.arrays import Vector
from groundstation.kernel import kernel
from groundstation.planning.covariance import invert, predict, room_for
from groundstation.planning.records import TARGET_STATES, CostProblem, X, Y
from groundstation.sensing.visibility import SPREAD


@kernel()
def most_information(
    problem: CostProblem, e: int, i: int, reach: Vector, low: Vector, high: Vector, turn_rad2: float
) -> float:
    """Return an upper bound of the information of an edge in step i, for all controls until then."""
    edge, n = problem.edges[e], problem.poses.shape[0]
    camera, steps, markers = problem.cameras[edge.camera], i + 1.0, problem.markers
    bottom = top = markers[edge.subject]
    ahead, far = steps * problem.options.step_s, 0.0
    if edge.subject < n:
        x, y = problem.poses[edge.subject, X], problem.poses[edge.subject, Y]
        far = steps * reach[edge.subject]
        bottom, top = bottom + low[edge.subject], top + high[edge.subject]
    else:
        target = problem.targets[edge.subject - n]
        x, y = target[0] + ahead * target[2], target[1] + ahead * target[3]
    if edge.observer >= 0:
        x, y = x - problem.poses[edge.observer, X], y - problem.poses[edge.observer, Y]
        far += steps * reach[edge.observer] + math.sqrt(camera.position[0] ** 2 + camera.position[1] ** 2)
        bottom, top = bottom - high[edge.observer], top - low[edge.observer]
    else:
        x, y = x - camera.position[0], y - camera.position[1]
    distance = math.sqrt(x * x + y * y)
    bottom, top = bottom - camera.position[2], top - camera.position[2]
    upright = max(0.0, max(bottom, -top))
    square = max(0.0, distance - far) ** 2 + upright * upright
    most, outside = (distance + far) ** 2 + max(bottom * bottom, top * top), camera.range_m - math.sqrt(square)
    likely: float = 1.0
    if outside < 0.0:
        width2 = camera.width_m * camera.width_m + SPREAD * (edge.blur_m2 + edge.turn_rad2 * most)
        likely = 1.0 / (1.0 + math.exp(min(-outside / math.sqrt(width2), 500.0))) + camera.tail_share
    single = camera.base_m * camera.base_m + camera.per_m2 * camera.per_m2 * square * square
    lean = camera.per_m * camera.per_m
    level = (square - upright * upright) * (turn_rad2 if edge.observer >= 0 else lean)
    information: float = likely / (single / problem.options.readings + lean * upright * upright + level)
    return information


@kernel()
def lower_bound(problem: CostProblem, reach: Vector, low: Vector, high: Vector) -> float:
    """Return a lower bound of the cost of all topologies and controls, for a problem whose edges are all pairs.

    The cost decreases with every information, and an information is at most that at the smallest distance that two
    entities can reach; reach (n): of each robot per step [m], along the diagonal of its controls' box; low, high (n):
    limits of its height [m]. Penalties are at least 0. docs/explanation/planning.md 5.
    """
    n, k, h, m = problem.poses.shape[0], problem.targets.shape[0], problem.options.steps, problem.edges.shape[0]
    options, P, cameras, cost, discount = problem.options, room_for(problem.prior), problem.cameras, 0.0, 1.0
    turns = problem.yaw_variances.copy()
    sharper = np.empty(n)
    for i in range(h):
        predict(P, n, n + TARGET_STATES * k, options)
        invert(P)
        for r in range(n):
            turns[r] += options.robot_yaw_noise * options.step_s
            sharper[r] = 1.0 / turns[r]
        for e in range(m):
            edge = problem.edges[e]
            if edge.subject < n:
                yaw = cameras[edge.camera].yaw_rad
                turn = turns[edge.observer] if edge.observer >= 0 else 0.0
                sharper[edge.subject] += 1.0 / (yaw * yaw / options.readings + turn)
        for r in range(n):
            turns[r] = 1.0 / sharper[r]
        for e in range(m):
            a, b = problem.edges[e].observer, problem.edges[e].subject
            w = most_information(problem, e, i, reach, low, high, turns[a] if a >= 0 else 0.0)
            b = b if b < n else n + TARGET_STATES * (b - n)
            P[b, b] += w
            if a >= 0:
                P[a, a] += w
                P[a, b] -= w
                P[b, a] -= w
        invert(P)
        discount *= options.discount
        for t in range(k):
            x = n + TARGET_STATES * t
            cost += 2.0 * discount * problem.target_weights[t] * P[x, x]
        for r in range(n):
            cost += 2.0 * discount * options.robot_weight * P[r, r]
    return cost
