"""Compiled covariance steps of the rollout and their adjoints.

`P` is the covariance, `W` its adjoint (dc/dP), both symmetric (d, d). Mathematics:
docs/explanation/planning.md 1, 2.
"""

from groundstation.arrays import Matrix, Vector
from groundstation.kernel import kernel
from groundstation.planning.records import ROBOT_STATES, TARGET_STATES, VX, VY, YAW, Combination, CostOptions, X, Y


@kernel()
def predict(P: Matrix, motion: Matrix, yaw_columns: Matrix, options: CostOptions) -> None:
    """P <- F P F^T + Q; motion (n, 3) holds each robot's displacement; keeps F P e_yaw of each robot."""
    n, d = motion.shape[0], P.shape[0]
    dt, q_xy, q_yaw = options.step_s, options.robot_position_noise, options.robot_yaw_noise
    q_acc = options.target_acceleration_noise
    for r in range(n):
        x, y, yaw = ROBOT_STATES * r + X, ROBOT_STATES * r + Y, ROBOT_STATES * r + YAW
        for j in range(d):
            P[x, j] -= motion[r, Y] * P[yaw, j]
            P[y, j] += motion[r, X] * P[yaw, j]
    for x in range(ROBOT_STATES * n, d, TARGET_STATES):
        for j in range(d):
            P[x, j] += dt * P[x + VX, j]
            P[x + Y, j] += dt * P[x + VY, j]
    for i in range(d):
        for r in range(n):
            x, y, yaw = ROBOT_STATES * r + X, ROBOT_STATES * r + Y, ROBOT_STATES * r + YAW
            P[i, x] -= motion[r, Y] * P[i, yaw]
            P[i, y] += motion[r, X] * P[i, yaw]
            yaw_columns[r, i] = P[i, yaw]
        for x in range(ROBOT_STATES * n, d, TARGET_STATES):
            P[i, x] += dt * P[i, x + VX]
            P[i, x + Y] += dt * P[i, x + VY]
    for r in range(n):
        x, y, yaw = ROBOT_STATES * r + X, ROBOT_STATES * r + Y, ROBOT_STATES * r + YAW
        P[x, x] += q_xy * dt
        P[y, y] += q_xy * dt
        P[yaw, yaw] += q_yaw * dt
    for first in range(ROBOT_STATES * n, d, TARGET_STATES):
        for x in range(first, first + 2):
            P[x, x] += q_acc * dt * dt * dt / 3.0
            P[x, x + VX] += q_acc * dt * dt / 2.0
            P[x + VX, x] += q_acc * dt * dt / 2.0
            P[x + VX, x + VX] += q_acc * dt


@kernel()
def predict_adjoint(W: Matrix, motion: Matrix, yaw_columns: Matrix, dt: float, motion_adjoint: Matrix) -> None:
    """W <- F^T W F; writes dc/d displacement through F into motion_adjoint (n, 2)."""
    n, d = motion.shape[0], W.shape[0]
    for r in range(n):
        along_x = along_y = 0.0
        for j in range(d):
            along_x += W[ROBOT_STATES * r + X, j] * yaw_columns[r, j]
            along_y += W[ROBOT_STATES * r + Y, j] * yaw_columns[r, j]
        motion_adjoint[r, X] = 2.0 * along_y
        motion_adjoint[r, Y] = -2.0 * along_x
    for r in range(n):
        x, y, yaw = ROBOT_STATES * r + X, ROBOT_STATES * r + Y, ROBOT_STATES * r + YAW
        for j in range(d):
            W[yaw, j] += motion[r, X] * W[y, j] - motion[r, Y] * W[x, j]
    for x in range(ROBOT_STATES * n, d, TARGET_STATES):
        for j in range(d):
            W[x + VX, j] += dt * W[x, j]
            W[x + VY, j] += dt * W[x + Y, j]
    for i in range(d):
        for r in range(n):
            x, y, yaw = ROBOT_STATES * r + X, ROBOT_STATES * r + Y, ROBOT_STATES * r + YAW
            W[i, yaw] += motion[r, X] * W[i, y] - motion[r, Y] * W[i, x]
        for x in range(ROBOT_STATES * n, d, TARGET_STATES):
            W[i, x + VX] += dt * W[i, x]
            W[i, x + VY] += dt * W[i, x + Y]


@kernel()
def correct(P: Matrix, a: Combination, w: float, g: Vector, yaw_row: Vector, v: Vector) -> None:
    """Fuse the scalar a^T x with information w; keeps g = P+ a and row `yaw` of P+ for the adjoint; v: work space."""
    to, origin, yaw, lever = a.to, a.origin, a.yaw, a.lever
    d = P.shape[0]
    for j in range(d):
        v[j] = P[to, j]
    if origin >= 0:
        for j in range(d):
            v[j] -= P[origin, j]
    if yaw >= 0:
        for j in range(d):
            v[j] += lever * P[yaw, j]
    spread = v[to]
    if origin >= 0:
        spread -= v[origin]
    if yaw >= 0:
        spread += lever * v[yaw]
    scale = 1.0 / (1.0 + w * spread)
    for j in range(d):
        g[j] = v[j] * scale
    for i in range(d):
        factor = w * scale * v[i]
        for j in range(d):
            P[i, j] -= factor * v[j]
    if yaw >= 0:
        for j in range(d):
            yaw_row[j] = P[yaw, j]


@kernel()
def correct_adjoint(W: Matrix, a: Combination, w: float, g: Vector, yaw_row: Vector, y: Vector) -> tuple[float, float]:
    """W <- (I - a K^T) W (I - K a^T); returns (dc/dw, dc/d lever); y is work space."""
    to, origin, yaw, lever = a.to, a.origin, a.yaw, a.lever
    d = W.shape[0]
    gy = lever_adjoint = 0.0
    for i in range(d):
        total = 0.0
        for j in range(d):
            total += W[i, j] * g[j]
        y[i] = total
        gy += g[i] * total
    if yaw >= 0:
        for j in range(d):
            lever_adjoint += yaw_row[j] * y[j]
    # W -= a q^T + q a^T with q = w y - (w^2 g.y / 2) a.
    for j in range(d):
        y[j] *= w
    half = 0.5 * w * w * gy
    y[to] -= half
    if origin >= 0:
        y[origin] += half
    if yaw >= 0:
        y[yaw] -= half * lever
    for part in range(3):
        index = to if part == 0 else (origin if part == 1 else yaw)
        if index < 0:
            continue
        weight = 1.0 if part == 0 else (-1.0 if part == 1 else lever)
        for j in range(d):
            W[index, j] -= weight * y[j]
        for j in range(d):
            W[j, index] -= weight * y[j]
    return -gy, -2.0 * w * lever_adjoint
