"""Compiled rollout of the joint covariance under held controls: the value, and a tape for the adjoint."""

import math
from typing import Any

import numpy as np

from groundstation.arrays import Matrix, Vector
from groundstation.kernel import Rows, kernel
from groundstation.planning.covariance import invert, predict, room_for
from groundstation.planning.dense import padded
from groundstation.planning.records import (
    COS,
    HEIGHT,
    POSE_YAW,
    POSE_Z,
    ROBOT_CONTROLS,
    SIN,
    TARGET_STATES,
    YAW,
    CostOptions,
    CostProblem,
    EdgeTape,
    Tape,
    X,
    Y,
    Z,
)
from groundstation.planning.sightings import look_around, views_of
from groundstation.sensing.occlusion import BoxRow

_EDGE_TAPE = EdgeTape.dtype


@kernel(inlined=True)
def empty_tape(n: int, h: int, m: int, d: int) -> Tape:
    """Return a tape for n robots, h steps, m edges and d entries of the state."""
    wide = padded(d)
    sightings: Any = np.empty(h * m, _EDGE_TAPE)
    return Tape(
        np.empty((h + 1, n, 6)), np.empty((h, n, 4)), sightings, np.empty((h, wide, wide)),
        np.empty((h, wide, wide)),
        np.empty((h, n)), np.empty((h, n)), np.empty((h, n, 3)),
    )  # fmt: skip


@kernel()
def move(u: Vector, before: Matrix, dt: float, after: Matrix, motion: Matrix) -> None:
    """Advance (x, y, yaw) of all robots by held body velocities; motion: displacement x, y and its direction."""
    for r in range(before.shape[0]):
        vx, vy, rate = u[ROBOT_CONTROLS * r + X], u[ROBOT_CONTROLS * r + Y], u[ROBOT_CONTROLS * r + YAW]
        yaw = before[r, YAW] + 0.5 * dt * rate
        c, s = math.cos(yaw), math.sin(yaw)
        motion[r, X] = dt * (c * vx - s * vy)
        motion[r, Y] = dt * (s * vx + c * vy)
        motion[r, YAW] = yaw
        after[r, X] = before[r, X] + motion[r, X]
        after[r, Y] = before[r, Y] + motion[r, Y]
        after[r, YAW] = before[r, YAW] + dt * rate
        after[r, COS], after[r, SIN] = math.cos(after[r, YAW]), math.sin(after[r, YAW])


@kernel()
def climb(u: Vector, problem: CostProblem, i: int, after: Matrix, motion: Matrix) -> None:
    """Write the heights after step i of robots that approach those of their controls, ever more slowly."""
    for r in range(after.shape[0]):
        z = problem.poses[r, POSE_Z]
        most = problem.climbs[r] * problem.options.step_s * (i + 1.0)
        share = math.tanh((problem.options.height_m + u[ROBOT_CONTROLS * r + HEIGHT] - z) / most)
        after[r, Z] = z + most * share
        motion[r, HEIGHT] = 1.0 - share * share


@kernel()
def soft_box(box: BoxRow, place: Vector, options: CostOptions, gradient: Vector) -> float:
    """Return the penalty of a place too near to a box, by the way out; adds d/d(x, y, z)."""
    x, y, z = place[X] - box.middle[0], place[Y] - box.middle[1], place[Z] - box.middle[2]
    out_x, out_y, out_z = abs(x) - box.half[0], abs(y) - box.half[1], z - box.half[2]
    depth = options.obstacle_m - max(out_x, max(out_y, out_z))
    if depth <= 0.0:
        return 0.0
    weight: float = options.fence_weight
    slope = -2.0 * weight * depth
    if out_z >= max(out_x, out_y):
        gradient[2] += slope
    elif out_x >= out_y:
        gradient[0] += slope if x > 0.0 else -slope
    else:
        gradient[1] += slope if y > 0.0 else -slope
    return float(weight * depth * depth)


@kernel()
def penalty(path: Matrix, boxes: Rows[BoxRow], options: CostOptions, gradient: Matrix) -> float:
    """Return repulsion between robots, soft fence and soft boxes at one step; adds d/d(x, y, z) to gradient (n, 3)."""
    n, cost = path.shape[0], 0.0
    weight, reach, wall = options.repulsion_weight, options.separation_m, options.fence_weight
    for a in range(n):
        for b in range(a):
            dx, dy = path[a, X] - path[b, X], path[a, Y] - path[b, Y]
            d2 = dx * dx + dy * dy + 1e-3
            if d2 < reach * reach:
                d = math.sqrt(d2)
                over = reach / d - 1.0
                cost += weight * over * over
                slope = -2.0 * weight * over * reach / (d2 * d)
                gradient[a, X] += slope * dx
                gradient[a, Y] += slope * dy
                gradient[b, X] -= slope * dx
                gradient[b, Y] -= slope * dy
        for axis in range(2):
            low, high = options.fence[axis, 0] - path[a, axis], path[a, axis] - options.fence[axis, 1]
            out = max(low, high)
            if out > 0.0:
                cost += wall * out * out
                gradient[a, axis] += 2.0 * wall * (high if high > low else -low)
        for k in range(boxes.shape[0]):
            cost += soft_box(boxes[k], path[a], options, gradient[a])
    return cost


@kernel(inlined=True)
def weigh(problem: CostProblem, tape: Tape, i: int) -> None:
    """Turn availabilities into informations, headings first: a well-known heading makes positions precise."""
    edges, cameras, sightings, readings = problem.edges, problem.cameras, tape.sightings, problem.options.readings
    before, after = tape.yaws_before[i], tape.yaws_after[i]
    n, m = before.shape[0], edges.shape[0]
    for r in range(n):
        before[r] = problem.options.robot_yaw_noise * problem.options.step_s
        before[r] += problem.yaw_variances[r] if i == 0 else tape.yaws_after[i - 1, r]
        after[r] = 1.0 / before[r]
    for e in range(m):
        edge, seen = edges[e], sightings[i * m + e]
        seen.v = 0.0
        if edge.subject < n and seen.a > 0.0:
            yaw = cameras[edge.camera].yaw_rad
            seen.v = seen.a / (yaw * yaw / readings + (before[edge.observer] if edge.observer >= 0 else 0.0))
            after[edge.subject] += seen.v
    for r in range(n):
        after[r] = 1.0 / after[r]
    for e in range(m):
        edge, seen = edges[e], sightings[i * m + e]
        camera, upright = cameras[edge.camera], seen.z * seen.z
        lean = camera.per_m * camera.per_m
        turn = after[edge.observer] if edge.observer >= 0 else lean
        single = camera.base_m * camera.base_m + camera.per_m2 * camera.per_m2 * seen.square * seen.square
        seen.variance = single / readings + lean * upright + turn * (seen.square - upright)
        seen.w = seen.a / seen.variance


@kernel(inlined=True)
def fuse(P: Matrix, problem: CostProblem, tape: Tape, i: int) -> None:
    """P <- (P^-1 + sum w a a^T)^-1 over all edges of one step; keeps P^-1 and the result."""
    edges, sightings, before, after = problem.edges, tape.sightings, tape.informations[i], tape.covariances[i]
    n, m, d = problem.poses.shape[0], edges.shape[0], P.shape[0]
    invert(P)
    for j in range(d):
        for k in range(d):
            before[j, k] = after[j, k] = P[j, k]
    for e in range(m):
        a, b, w = edges[e].observer, edges[e].subject, sightings[i * m + e].w
        b = b if b < n else n + TARGET_STATES * (b - n)
        after[b, b] += w
        if a >= 0:
            after[a, a] += w
            after[a, b] -= w
            after[b, a] -= w
    invert(after)
    for j in range(d):
        for k in range(d):
            P[j, k] = after[j, k]


@kernel()
def roll_out(u: Vector, problem: CostProblem, tape: Tape) -> tuple[float, float]:
    """Return (expected uncertainty of the targets, all other costs) of held controls u (4 n) and fill the tape."""
    n, k, h = problem.poses.shape[0], problem.targets.shape[0], problem.options.steps
    options, P, weights = problem.options, room_for(problem.prior), problem.target_weights
    path, motion, penalties = tape.path, tape.motion, tape.penalties
    for r in range(n):
        path[0, r, X], path[0, r, Y] = problem.poses[r, X], problem.poses[r, Y]
        path[0, r, YAW] = problem.poses[r, POSE_YAW]
    views, m = views_of(problem), problem.edges.shape[0]
    points, found = np.empty((3, m)), np.empty((4, m))
    uncertainty = extra = 0.0
    discount = 1.0
    for i in range(h):
        move(u, path[i], options.step_s, path[i + 1], motion[i])
        climb(u, problem, i, path[i + 1], motion[i])
        predict(P, n, problem.prior.shape[0], options)
        look_around(problem, tape, i, views, points, found)
        weigh(problem, tape, i)
        fuse(P, problem, tape, i)
        discount *= options.discount
        for t in range(k):
            x = n + TARGET_STATES * t
            uncertainty += 2.0 * discount * weights[t] * P[x, x]
        for r in range(n):
            extra += 2.0 * discount * options.robot_weight * P[r, r]
        penalties[i, :, :] = 0.0
        extra += discount * penalty(path[i + 1], problem.boxes, options, penalties[i])
    return uncertainty, extra
