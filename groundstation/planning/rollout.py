"""Compiled rollout of the joint covariance under held controls: the value, and a tape for the adjoint."""

import math
from typing import Any

import numpy as np

from groundstation.arrays import Matrix, Vector
from groundstation.kernel import kernel
from groundstation.planning.covariance import correct, predict
from groundstation.planning.records import (
    POSE_YAW,
    ROBOT_STATES,
    TARGET_STATES,
    VX,
    VY,
    YAW,
    Combination,
    CostOptions,
    CostProblem,
    EdgeRow,
    EdgeTape,
    Tape,
    X,
    Y,
)
from groundstation.sensing.visibility import CameraRow, observe

_EDGE_TAPE = EdgeTape.dtype


@kernel(inlined=True)
def empty_tape(n: int, h: int, m: int, d: int) -> Tape:
    """Return a tape for n robots, h steps, m edges and d entries of the state."""
    sightings: Any = np.empty(h * m, _EDGE_TAPE)
    return Tape(
        np.empty((h + 1, n, ROBOT_STATES)), np.empty((h, n, ROBOT_STATES)), np.empty((h, n, d)), sightings,
        np.empty((h, 3 * m, d)), np.empty((h, 3 * m, d)), np.empty((h, n, ROBOT_STATES)),
    )  # fmt: skip


@kernel()
def move(u: Vector, before: Matrix, dt: float, after: Matrix, motion: Matrix) -> None:
    """Advance (x, y, yaw) of all robots by held body velocities; motion: displacement x, y and its direction."""
    for r in range(before.shape[0]):
        vx, vy, rate = u[ROBOT_STATES * r + X], u[ROBOT_STATES * r + Y], u[ROBOT_STATES * r + YAW]
        yaw = before[r, YAW] + 0.5 * dt * rate
        c, s = math.cos(yaw), math.sin(yaw)
        motion[r, X] = dt * (c * vx - s * vy)
        motion[r, Y] = dt * (s * vx + c * vy)
        motion[r, YAW] = yaw
        after[r, X] = before[r, X] + motion[r, X]
        after[r, Y] = before[r, Y] + motion[r, Y]
        after[r, YAW] = before[r, YAW] + dt * rate


@kernel(inlined=True)
def look(camera: CameraRow, onboard: bool, x: float, y: float, z: float, yaw: float, tape: EdgeTape) -> None:
    """Record what a camera sees of a subject at (x, y, z) from its observer (or from the world's origin if fixed)."""
    c, s = 1.0, 0.0
    if onboard:
        c, s = math.cos(yaw), math.sin(yaw)
    bx, by = c * x + s * y, -s * x + c * y
    rx, ry, rz = bx - camera.position[0], by - camera.position[1], z - camera.position[2]
    R = camera.rotation
    seen = observe(
        camera,
        R[0, 0] * rx + R[0, 1] * ry + R[0, 2] * rz,
        R[1, 0] * rx + R[1, 1] * ry + R[1, 2] * rz,
        R[2, 0] * rx + R[2, 1] * ry + R[2, 2] * rz,
    )
    gx = R[0, 0] * seen.w_x + R[1, 0] * seen.w_y + R[2, 0] * seen.w_z
    gy = R[0, 1] * seen.w_x + R[1, 1] * seen.w_y + R[2, 1] * seen.w_z
    tape.w, tape.w_x, tape.w_y = seen.w, c * gx - s * gy, s * gx + c * gy
    tape.w_yaw = gx * by - gy * bx if onboard else 0.0
    gx = R[0, 0] * seen.v_x + R[1, 0] * seen.v_y + R[2, 0] * seen.v_z
    gy = R[0, 1] * seen.v_x + R[1, 1] * seen.v_y + R[2, 1] * seen.v_z
    tape.v, tape.v_x, tape.v_y = seen.v, c * gx - s * gy, s * gx + c * gy
    tape.v_yaw = gx * by - gy * bx if onboard else 0.0
    tape.x, tape.y = x, y


@kernel(inlined=True)
def first_index(entity: int, n: int) -> int:
    """Return where an entity's x stands in the planner's state."""
    return ROBOT_STATES * entity if entity < n else ROBOT_STATES * n + TARGET_STATES * (entity - n)


@kernel(inlined=True)
def combinations(edge: EdgeRow, n: int, x: float, y: float) -> tuple[Combination, Combination, Combination]:
    """Return what an edge measures: the subject's x and y in the observer's turned frame, and its heading.

    (x, y): relative position [world]; the heading is measured of robots alone.
    """
    a, to = edge.observer, first_index(edge.subject, n)
    origin, below, turn = -1, -1, -1
    if a >= 0:
        origin, below, turn = ROBOT_STATES * a + X, ROBOT_STATES * a + Y, ROBOT_STATES * a + YAW
    return (
        Combination(to + X, origin, turn, y), Combination(to + Y, below, turn, -x), Combination(to + YAW, turn, -1, 0.0)
    )  # fmt: skip


@kernel()
def penalty(path: Matrix, options: CostOptions, gradient: Matrix) -> float:
    """Return repulsion between robots and soft fence at one step; adds d/d(x, y) to gradient (n, 3)."""
    n, cost = path.shape[0], 0.0
    weight, reach, wall = options.repulsion_weight, options.separation_m, options.fence_weight
    for a in range(n):
        for b in range(a):
            dx, dy = path[a, X] - path[b, X], path[a, Y] - path[b, Y]
            d2 = dx * dx + dy * dy + 1e-3
            d = math.sqrt(d2)
            if d < reach:
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
    return cost


@kernel(inlined=True)
def fuse(P: Matrix, problem: CostProblem, tape: Tape, i: int, work: Vector) -> None:
    """Look along all edges in one step, and correct P by what they see.

    Arrays are taken out of their tuples once: doing so for every edge counts references for a tenth of the time.
    """
    edges, cameras, targets, heights, markers = (
        problem.edges, problem.cameras, problem.targets, problem.heights, problem.markers
    )  # fmt: skip
    path, sightings, gains, yaw_rows = tape.path, tape.sightings, tape.gains, tape.yaw_rows
    n, m, ahead = path.shape[1], edges.shape[0], (i + 1) * problem.options.step_s
    for e in range(m):
        edge, seen, row = edges[e], sightings[i * m + e], 3 * e
        a, b, yaw = edge.observer, edge.subject, 0.0
        if b < n:
            x, y, z = path[i + 1, b, X], path[i + 1, b, Y], heights[i, b] + markers[b]
        else:
            t = b - n
            x, y, z = targets[t, X] + ahead * targets[t, VX], targets[t, Y] + ahead * targets[t, VY], markers[b]
        if a >= 0:
            x, y, z, yaw = x - path[i + 1, a, X], y - path[i + 1, a, Y], z - heights[i, a], path[i + 1, a, YAW]
        look(cameras[edge.camera], a >= 0, x, y, z, yaw, seen)
        along_x, along_y, heading = combinations(edge, n, x, y)
        correct(P, along_x, seen.w, gains[i, row], yaw_rows[i, row], work)
        correct(P, along_y, seen.w, gains[i, row + 1], yaw_rows[i, row + 1], work)
        if b < n:
            correct(P, heading, seen.v, gains[i, row + 2], yaw_rows[i, row + 2], work)


@kernel()
def roll_out(u: Vector, problem: CostProblem, tape: Tape) -> tuple[float, float]:
    """Return (expected uncertainty of the targets, all other costs) of held controls u (3 n) and fill the tape."""
    n, k, h = problem.poses.shape[0], problem.targets.shape[0], problem.heights.shape[0]
    options, P = problem.options, problem.prior.copy()
    work, path, motion, penalties = np.empty(P.shape[0]), tape.path, tape.motion, tape.penalties
    yaw_columns, weights = tape.yaw_columns, problem.target_weights
    for r in range(n):
        path[0, r, X], path[0, r, Y] = problem.poses[r, X], problem.poses[r, Y]
        path[0, r, YAW] = problem.poses[r, POSE_YAW]
    uncertainty = extra = 0.0
    discount = 1.0
    for i in range(h):
        move(u, path[i], options.step_s, path[i + 1], motion[i])
        predict(P, motion[i], yaw_columns[i], options)
        fuse(P, problem, tape, i, work)
        discount *= options.discount
        for t in range(k):
            x = ROBOT_STATES * n + TARGET_STATES * t
            uncertainty += discount * weights[t] * (P[x, x] + P[x + 1, x + 1])
        for x in range(0, ROBOT_STATES * n, ROBOT_STATES):
            extra += discount * options.robot_weight * (P[x, x] + P[x + 1, x + 1])
        penalties[i, :, :] = 0.0
        extra += discount * penalty(path[i + 1], options, penalties[i])
    return uncertainty, extra
