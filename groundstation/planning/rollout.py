"""Compiled rollout of the joint covariance under held controls: the value, and a tape for the adjoint."""

import math
from typing import Any

import numpy as np

from groundstation.arrays import Matrix, Vector
from groundstation.kernel import kernel
from groundstation.planning.covariance import invert, predict
from groundstation.planning.records import (
    COS,
    HEIGHT,
    POSE_YAW,
    POSE_Z,
    ROBOT_CONTROLS,
    SIN,
    TARGET_STATES,
    VX,
    VY,
    YAW,
    CostOptions,
    CostProblem,
    EdgeRow,
    EdgeTape,
    Tape,
    X,
    Y,
    Z,
)
from groundstation.sensing.occlusion import SOFT_M, sight
from groundstation.sensing.visibility import SPREAD, CameraRow, available

_EDGE_TAPE = EdgeTape.dtype
_BEYOND = 12.0  # so many widths of its edge beyond a range, what is no edge of the topology is not counted


@kernel(inlined=True)
def empty_tape(n: int, h: int, m: int, d: int) -> Tape:
    """Return a tape for n robots, h steps, m edges and d entries of the state."""
    sightings: Any = np.empty(h * m, _EDGE_TAPE)
    return Tape(
        np.empty((h + 1, n, 6)), np.empty((h, n, 4)), sightings, np.empty((h, d, d)), np.empty((h, d, d)),
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
    """Write the heights after step i of robots that go to those of their controls, ever slower as they get there."""
    for r in range(after.shape[0]):
        z = problem.poses[r, POSE_Z]
        most = problem.climbs[r] * problem.options.step_s * (i + 1.0)
        share = math.tanh((problem.options.height_m + u[ROBOT_CONTROLS * r + HEIGHT] - z) / most)
        after[r, Z] = z + most * share
        motion[r, HEIGHT] = 1.0 - share * share


@kernel()
def look(camera: CameraRow, edge: EdgeRow, x: float, y: float, z: float, c: float, s: float, tape: EdgeTape) -> None:
    """Record how likely a camera sees a subject at (x, y, z) from its observer (or from the world's origin if fixed).

    c, s: cosine and sine of the observer's heading.
    """
    tape.x, tape.y = x, y
    bx, by = c * x + s * y, -s * x + c * y
    rx, ry, rz = bx - camera.position[0], by - camera.position[1], z - camera.position[2]
    tape.z, tape.square = rz, rx * rx + ry * ry + rz * rz
    if edge.wanted == 0 and tape.square > camera.range_m * camera.range_m:
        width2 = camera.width_m * camera.width_m + SPREAD * (edge.blur_m2 + edge.turn_rad2 * tape.square)
        beyond = camera.range_m + _BEYOND * math.sqrt(width2)
        if tape.square > beyond * beyond:
            tape.a = tape.a_x = tape.a_y = tape.a_z = tape.a_yaw = 0.0
            return
    R = camera.rotation
    seen = available(
        camera,
        R[0, 0] * rx + R[0, 1] * ry + R[0, 2] * rz,
        R[1, 0] * rx + R[1, 1] * ry + R[1, 2] * rz,
        R[2, 0] * rx + R[2, 1] * ry + R[2, 2] * rz,
        edge.blur_m2, edge.turn_rad2, camera.tail_share if edge.wanted > 0 else 0.0,
    )  # fmt: skip
    gx = R[0, 0] * seen.a_x + R[1, 0] * seen.a_y + R[2, 0] * seen.a_z
    gy = R[0, 1] * seen.a_x + R[1, 1] * seen.a_y + R[2, 1] * seen.a_z
    tape.a, tape.a_x, tape.a_y = seen.a, c * gx - s * gy, s * gx + c * gy
    tape.a_z = R[0, 2] * seen.a_x + R[1, 2] * seen.a_y + R[2, 2] * seen.a_z
    tape.a_yaw = gx * by - gy * bx if edge.observer >= 0 else 0.0


@kernel()
def hide(problem: CostProblem, tape: Tape, i: int, e: int) -> None:
    """Count what boxes hide of one edge in one step: less is available, and it depends on where both are."""
    edge, seen = problem.edges[e], tape.sightings[i * problem.edges.shape[0] + e]
    seen.along_x = seen.along_y = seen.along_z = 0.0
    if seen.a <= 0.0:
        return
    camera, a, c, s, x, y, z = problem.cameras[edge.camera], edge.observer, 1.0, 0.0, 0.0, 0.0, 0.0
    if a >= 0:
        place = tape.path[i + 1, a]
        c, s, x, y, z = place[COS], place[SIN], place[X], place[Y], place[Z]
    off_x, off_y = c * camera.position[0] - s * camera.position[1], s * camera.position[0] + c * camera.position[1]
    z += camera.position[2]
    width = math.sqrt(SOFT_M * SOFT_M + SPREAD * edge.blur_m2)
    free = sight(problem.boxes, width, x + off_x, y + off_y, z, x + seen.x, y + seen.y, z + seen.z)
    seen.along_x, seen.along_y = seen.a * (free.eye_x + free.x), seen.a * (free.eye_y + free.y)
    seen.along_z = seen.a * (free.eye_z + free.z)
    seen.a_x, seen.a_y = free.a * seen.a_x + seen.a * free.x, free.a * seen.a_y + seen.a * free.y
    seen.a_z = free.a * seen.a_z + seen.a * free.z
    if a >= 0:
        seen.a_yaw = free.a * seen.a_yaw + seen.a * (off_x * free.eye_y - off_y * free.eye_x)
    seen.a *= free.a


@kernel()
def penalty(path: Matrix, options: CostOptions, gradient: Matrix) -> float:
    """Return repulsion between robots and soft fence at one step; adds d/d(x, y) to gradient (n, 3)."""
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
    return cost


@kernel(inlined=True)
def look_around(problem: CostProblem, tape: Tape, i: int) -> None:
    """Record in the tape what all edges see in one step."""
    edges, cameras, targets, markers, path, sightings = (
        problem.edges, problem.cameras, problem.targets, problem.markers, tape.path, tape.sightings
    )  # fmt: skip
    n, m, ahead = path.shape[1], edges.shape[0], (i + 1) * problem.options.step_s
    for e in range(m):
        edge, seen = edges[e], sightings[i * m + e]
        a, b, c, s = edge.observer, edge.subject, 1.0, 0.0
        if b < n:
            x, y, z = path[i + 1, b, X], path[i + 1, b, Y], path[i + 1, b, Z] + markers[b]
        else:
            t = b - n
            x, y, z = targets[t, X] + ahead * targets[t, VX], targets[t, Y] + ahead * targets[t, VY], markers[b]
        if a >= 0:
            x, y, z = x - path[i + 1, a, X], y - path[i + 1, a, Y], z - path[i + 1, a, Z]
            c, s = path[i + 1, a, COS], path[i + 1, a, SIN]
        look(cameras[edge.camera], edge, x, y, z, c, s, seen)
        if problem.boxes.shape[0] > 0:
            hide(problem, tape, i, e)


@kernel(inlined=True)
def weigh(problem: CostProblem, tape: Tape, i: int) -> None:
    """Turn availabilities into informations, headings first: who knows its heading well measures positions well."""
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
    options, P, weights = problem.options, problem.prior.copy(), problem.target_weights
    path, motion, penalties = tape.path, tape.motion, tape.penalties
    for r in range(n):
        path[0, r, X], path[0, r, Y] = problem.poses[r, X], problem.poses[r, Y]
        path[0, r, YAW] = problem.poses[r, POSE_YAW]
    uncertainty = extra = 0.0
    discount = 1.0
    for i in range(h):
        move(u, path[i], options.step_s, path[i + 1], motion[i])
        climb(u, problem, i, path[i + 1], motion[i])
        predict(P, n, options)
        look_around(problem, tape, i)
        weigh(problem, tape, i)
        fuse(P, problem, tape, i)
        discount *= options.discount
        for t in range(k):
            x = n + TARGET_STATES * t
            uncertainty += 2.0 * discount * weights[t] * P[x, x]
        for r in range(n):
            extra += 2.0 * discount * options.robot_weight * P[r, r]
        penalties[i, :, :] = 0.0
        extra += discount * penalty(path[i + 1], options, penalties[i])
    return uncertainty, extra
