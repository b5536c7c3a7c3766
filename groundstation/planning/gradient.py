"""Compiled value and exact gradient of the planner's cost: rollout forwards, adjoint backwards over its tape."""

import math

import numpy as np

from groundstation.arrays import Matrix, Vector
from groundstation.kernel import kernel
from groundstation.planning.covariance import between, predict_adjoint
from groundstation.planning.dense import padded
from groundstation.planning.records import (
    COS,
    HEIGHT,
    POSE_Z,
    ROBOT_CONTROLS,
    SIN,
    TARGET_STATES,
    YAW,
    CostProblem,
    Tape,
    X,
    Y,
)
from groundstation.planning.rollout import empty_tape, roll_out


@kernel(inlined=True)
def lever(problem: CostProblem, tape: Tape, i: int, e: int) -> tuple[float, float]:
    """Return the vector from an edge's camera to its subject (x, y) [world]."""
    edge, seen = problem.edges[e], tape.sightings[i * problem.edges.shape[0] + e]
    camera, x, y = problem.cameras[edge.camera], seen.x, seen.y
    px, py = camera.position[0], camera.position[1]
    if edge.observer < 0:
        return x - px, y - py
    c, s = tape.path[i + 1, edge.observer, COS], tape.path[i + 1, edge.observer, SIN]
    return x - (c * px - s * py), y - (s * px + c * py)


@kernel(inlined=True)
def undo_weights(
    M: Matrix, problem: CostProblem, tape: Tape, i: int, state: Matrix, yaws: Vector, work: Vector
) -> None:
    """Propagate M = -dc/d(information) and dc/d(variance of yaw) back over one step's sightings.

    Adds to dc/d(x, y, yaw, z) `state` (n, 4). yaws (n): derivatives by the variances after the step, on return before
    it; work (n).
    """
    edges, cameras, sightings, readings = problem.edges, problem.cameras, tape.sightings, problem.options.readings
    before, after = tape.yaws_before[i], tape.yaws_after[i]
    n, m = before.shape[0], edges.shape[0]
    for e in range(m):
        edge, seen = edges[e], sightings[i * m + e]
        a, b = edge.observer, edge.subject if edge.subject < n else n + TARGET_STATES * (edge.subject - n)
        by_w = -M[b, b] if a < 0 else 2.0 * M[a, b] - M[a, a] - M[b, b]
        # From here on v is dc/da, w is dc/d(level part of square), square dc/d(z^2), variance the information of the
        # heading.
        by_variance = -by_w * seen.w / seen.variance
        camera = cameras[edge.camera]
        turn = lean = camera.per_m * camera.per_m
        if a >= 0:
            turn = after[a]
            yaws[a] += by_variance * (seen.square - seen.z * seen.z)
        farther = 2.0 * camera.per_m2 * camera.per_m2 * seen.square / readings
        seen.w, seen.square = by_variance * (turn + farther), by_variance * (lean + farther)
        seen.variance, seen.v = seen.v, by_w / seen.variance
    for r in range(n):
        work[r] = -yaws[r] * after[r] * after[r]
        yaws[r] = -work[r] / (before[r] * before[r])
    for e in range(m):
        edge, seen = edges[e], sightings[i * m + e]
        a, b = edge.observer, edge.subject
        if seen.a <= 0.0:
            continue
        if b < n:
            per_a = seen.variance / seen.a
            seen.v += work[b] * per_a
            if a >= 0:
                yaws[a] -= work[b] * seen.variance * per_a
        spread_x, spread_y = lever(problem, tape, i, e)
        gx, gy = seen.v * seen.a_x + 2.0 * seen.w * spread_x, seen.v * seen.a_y + 2.0 * seen.w * spread_y
        gz = seen.v * seen.a_z + 2.0 * seen.square * seen.z
        if a >= 0:
            state[a, X] -= gx
            state[a, Y] -= gy
            state[a, HEIGHT] -= gz
            if problem.boxes.shape[0] > 0:
                state[a, X] += seen.v * seen.along_x
                state[a, Y] += seen.v * seen.along_y
                state[a, HEIGHT] += seen.v * seen.along_z
            state[a, YAW] += seen.v * seen.a_yaw + 2.0 * seen.w * (spread_x * seen.y - spread_y * seen.x)
        if b < n:
            state[b, X] += gx
            state[b, Y] += gy
            state[b, HEIGHT] += gz


@kernel(inlined=True)
def undo_move(state: Matrix, motion: Matrix, dt: float, gradient: Vector) -> None:
    """Propagate dc/d(x, y, yaw, z) back over one motion step; adds to dc/du. Heights do not depend on earlier ones."""
    for r in range(state.shape[0]):
        ax, ay = state[r, X], state[r, Y]
        c, s = math.cos(motion[r, YAW]), math.sin(motion[r, YAW])
        turn = motion[r, X] * ay - motion[r, Y] * ax
        gradient[ROBOT_CONTROLS * r + X] += dt * (c * ax + s * ay)
        gradient[ROBOT_CONTROLS * r + Y] += dt * (c * ay - s * ax)
        gradient[ROBOT_CONTROLS * r + YAW] += dt * (state[r, YAW] + 0.5 * turn)
        gradient[ROBOT_CONTROLS * r + HEIGHT] += state[r, HEIGHT] * motion[r, HEIGHT]
        state[r, YAW] += turn
        state[r, HEIGHT] = 0.0


@kernel()
def go_back(problem: CostProblem, tape: Tape, gradient: Vector) -> None:
    """Add the derivatives of uncertainty and penalties to dc/du, step by step backwards."""
    n, h, d, options = problem.poses.shape[0], problem.options.steps, problem.prior.shape[0], problem.options
    wide = padded(d)
    W, M, product = np.zeros((wide, wide)), np.empty((wide, wide)), np.empty((wide, wide))
    state, yaws, work = np.zeros((n, 4)), np.zeros(n), np.empty(n)
    for i in range(h - 1, -1, -1):
        discount = options.discount ** (i + 1)
        for t in range(problem.targets.shape[0]):
            x = n + TARGET_STATES * t
            W[x, x] += 2.0 * discount * problem.target_weights[t]
        for r in range(n):
            W[r, r] += 2.0 * discount * options.robot_weight
            for axis in range(2):
                state[r, axis] += discount * tape.penalties[i, r, axis]
            state[r, HEIGHT] += discount * tape.penalties[i, r, 2]
        between(tape.covariances[i], W, M, product)
        undo_weights(M, problem, tape, i, state, yaws, work)
        undo_move(state, tape.motion[i], options.step_s, gradient)
        if i > 0:
            between(tape.informations[i], M, W, product)
            predict_adjoint(W, n, d, options.step_s)


@kernel()
def evaluate(u: Vector, problem: CostProblem, wants_gradient: bool, gradient: Vector, report: Vector) -> float:
    """Return the cost of controls u (4 n) [m/s, m/s, rad/s; base_stabilized; height in m], and dc/du if wanted.

    report (1 + m): uncertainty alone, mean information of each edge.
    """
    n, h, m = problem.poses.shape[0], problem.options.steps, problem.edges.shape[0]
    scale, weight = problem.scale, problem.options.effort_weight
    tape = empty_tape(n, h, m, problem.prior.shape[0])
    uncertainty, extra = roll_out(u, problem, tape)
    report[0] = uncertainty
    for e in range(m):
        report[1 + e] = 0.0
        for i in range(h):
            report[1 + e] += tape.sightings[i * m + e].w / h
    effort = 0.0
    for r in range(n):
        for j in range(ROBOT_CONTROLS * r, ROBOT_CONTROLS * r + HEIGHT):
            effort += weight * (u[j] / scale[j]) ** 2
            gradient[j] = 2.0 * weight * u[j] / (scale[j] * scale[j])
        j, reach = ROBOT_CONTROLS * r + HEIGHT, problem.climbs[r] * problem.options.step_s * h
        way = (problem.options.height_m + u[j] - problem.poses[r, POSE_Z]) / reach
        effort += weight * way * way
        gradient[j] = 2.0 * weight * way / reach
    if wants_gradient:
        go_back(problem, tape, gradient)
    return uncertainty + extra + effort
