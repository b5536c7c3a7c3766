"""Compiled value and exact gradient of the planner's cost: rollout forwards, adjoint backwards over its tape."""

import math

import numpy as np

from groundstation.arrays import Matrix, Vector
from groundstation.kernel import kernel
from groundstation.planning.covariance import correct_adjoint, predict_adjoint
from groundstation.planning.records import ROBOT_STATES, TARGET_STATES, YAW, CostProblem, Tape, X, Y
from groundstation.planning.rollout import combinations, empty_tape, roll_out


@kernel(inlined=True)
def undo_edges(A: Matrix, problem: CostProblem, tape: Tape, i: int, state: Matrix, work: Vector) -> None:
    """Take the covariance adjoint A back over step i's corrections; adds to dc/d(x, y, yaw) `state` (n, 3)."""
    edges, sightings, gains, yaw_rows = problem.edges, tape.sightings, tape.gains, tape.yaw_rows
    n, m = state.shape[0], edges.shape[0]
    for e in range(m - 1, -1, -1):
        edge, seen, row = edges[e], sightings[i * m + e], 3 * e
        a, b = edge.observer, edge.subject
        along_x, along_y, heading = combinations(edge, n, seen.x, seen.y)
        v = 0.0
        if b < n:
            v, _ = correct_adjoint(A, heading, seen.v, gains[i, row + 2], yaw_rows[i, row + 2], work)
        w1, lever1 = correct_adjoint(A, along_y, seen.w, gains[i, row + 1], yaw_rows[i, row + 1], work)
        w0, lever0 = correct_adjoint(A, along_x, seen.w, gains[i, row], yaw_rows[i, row], work)
        w = w0 + w1
        gx = w * seen.w_x + v * seen.v_x
        gy = w * seen.w_y + v * seen.v_y
        if a >= 0:
            gx -= lever1
            gy += lever0
            state[a, X] -= gx
            state[a, Y] -= gy
            state[a, YAW] += w * seen.w_yaw + v * seen.v_yaw
        if b < n:
            state[b, X] += gx
            state[b, Y] += gy


@kernel(inlined=True)
def undo_move(state: Matrix, motion: Matrix, motion_adjoint: Matrix, dt: float, gradient: Vector) -> None:
    """Take dc/d(x, y, yaw) back over one motion step; adds to dc/du."""
    for r in range(state.shape[0]):
        ax, ay = state[r, X] + motion_adjoint[r, X], state[r, Y] + motion_adjoint[r, Y]
        c, s = math.cos(motion[r, YAW]), math.sin(motion[r, YAW])
        turn = motion[r, X] * ay - motion[r, Y] * ax
        gradient[ROBOT_STATES * r + X] += dt * (c * ax + s * ay)
        gradient[ROBOT_STATES * r + Y] += dt * (c * ay - s * ax)
        gradient[ROBOT_STATES * r + YAW] += dt * (state[r, YAW] + 0.5 * turn)
        state[r, YAW] += turn


@kernel()
def go_back(problem: CostProblem, tape: Tape, gradient: Vector) -> None:
    """Add the derivatives of uncertainty and penalties to dc/du, step by step backwards."""
    n, h, d, options = problem.poses.shape[0], problem.heights.shape[0], problem.prior.shape[0], problem.options
    A, state, back, work = np.zeros((d, d)), np.zeros((n, ROBOT_STATES)), np.empty((n, 2)), np.empty(d)
    for i in range(h - 1, -1, -1):
        discount = options.discount ** (i + 1)
        for t in range(problem.targets.shape[0]):
            x, weight = ROBOT_STATES * n + TARGET_STATES * t, discount * problem.target_weights[t]
            A[x, x] += weight
            A[x + 1, x + 1] += weight
        for r in range(n):
            x = ROBOT_STATES * r
            A[x, x] += discount * options.robot_weight
            A[x + 1, x + 1] += discount * options.robot_weight
            for axis in range(2):
                state[r, axis] += discount * tape.penalties[i, r, axis]
        undo_edges(A, problem, tape, i, state, work)
        predict_adjoint(A, tape.motion[i], tape.yaw_columns[i], options.step_s, back)
        undo_move(state, tape.motion[i], back, options.step_s, gradient)


@kernel()
def evaluate(u: Vector, problem: CostProblem, wants_gradient: bool, gradient: Vector, report: Vector) -> float:
    """Return the cost of held controls u (3 n) [m/s, m/s, rad/s; base_stabilized], and dc/du if wanted.

    report (1 + m): uncertainty alone, mean information of each edge.
    """
    n, h, m = problem.poses.shape[0], problem.heights.shape[0], problem.edges.shape[0]
    scale, weight = problem.scale, problem.options.effort_weight
    tape = empty_tape(n, h, m, problem.prior.shape[0])
    uncertainty, extra = roll_out(u, problem, tape)
    report[0] = uncertainty
    for e in range(m):
        report[1 + e] = 0.0
        for i in range(h):
            report[1 + e] += tape.sightings[i * m + e].w / h
    effort = 0.0
    for j in range(ROBOT_STATES * n):
        effort += weight * (u[j] / scale[j]) ** 2
        gradient[j] = 2.0 * weight * u[j] / (scale[j] * scale[j])
    if wants_gradient:
        go_back(problem, tape, gradient)
    return uncertainty + extra + effort
