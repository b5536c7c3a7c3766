"""Motion models: how each kind of entity's mean and covariance move in `dt` seconds.

Each predicts its own block row of P and mirrors it, so a step costs O(dim) per entity.
"""

import math

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.kernel import kernel
from groundstation.estimation.linear import wrap

# Prior of what joins, about the place that its first measurement puts it at: wide against any measurement, yet so
# that the correction which follows loses no more than eight digits.
DIFFUSE_M2 = 100.0
DIFFUSE_RAD2 = 10.0


@kernel("void(float64[:,::1], int64, int64)")
def mirror(P: Array, start: int, size: int) -> None:
    """Copy the block row onto the block column, so that P stays symmetric to the bit."""
    n = P.shape[0]
    for i in range(start, start + size):
        for j in range(n):
            if j < start or j >= start + size:
                P[j, i] = P[i, j]
    for i in range(start, start + size):
        for j in range(start, i):
            mean = 0.5 * (P[i, j] + P[j, i])
            P[i, j] = mean
            P[j, i] = mean


@kernel("void(float64[:,::1], int64, int64, float64)")
def add_row(P: Array, to: int, source: int, factor: float) -> None:
    """Add a multiple of one row of P to another."""
    for j in range(P.shape[0]):
        P[to, j] += factor * P[source, j]


@kernel("void(float64[:,::1], int64, int64, int64, float64)")
def add_column(P: Array, start: int, to: int, source: int, factor: float) -> None:
    """Add a multiple of one column to another, within the block of MAX_BLOCK rows that begins at start."""
    stop = min(start + s.MAX_BLOCK, P.shape[0])
    for i in range(start, stop):
        P[i, to] += factor * P[i, source]


@kernel("void(float64[::1], float64[:,::1], int64, int64, float64, float64)")
def fade(mean: Array, P: Array, start: int, offset: int, deviation: float, share: float) -> None:
    """Let a Gauss-Markov state decay towards zero over `share` of its correlation time, keeping its deviation."""
    index, decay = start + offset, math.exp(-share)
    mean[index] *= decay
    for j in range(P.shape[0]):
        P[index, j] *= decay
    stop = min(start + s.MAX_BLOCK, P.shape[0])
    for i in range(start, stop):
        P[i, index] *= decay
    P[index, index] += deviation * deviation * -math.expm1(-2.0 * share)


@kernel("void(float64[:,::1], int64, float64[::1], float64[::1], float64, float64)")
def add_robot_noise(P: Array, start: int, p: Array, aux: Array, dt: float, turn: float) -> None:
    """Add the process noise of an odometry-driven robot over dt, in which it turned by `turn`."""
    density = p[s.VELOCITY_DENSITY]
    if aux[s.ODOMETRY_AGE] > p[s.HOLD_S]:
        density += 0.09  # nothing is known of its speed: 0.3 m/s, constant over some 0.5 s
    P[start, start] += density * dt
    P[start + 1, start + 1] += density * dt
    P[start + s.YAW, start + s.YAW] += p[s.YAW_DENSITY] * dt + 0.0004 * turn * turn
    P[start + s.SCALE, start + s.SCALE] += p[s.SCALE_DENSITY] * dt
    P[start + s.Z, start + s.Z] += 1e-6 * dt


@kernel("void(float64[::1], float64[:,::1], int64, float64[::1], float64[::1], float64)")
def predict_odometry_robot(mean: Array, P: Array, start: int, p: Array, aux: Array, dt: float) -> None:
    """Move a robot by its held odometry: velocity [base_stabilized] times gain and scale state, and its yaw rate.

    PAPER: departs from the authors' program, which leaves out the derivative of the rotated velocity by yaw.
    """
    x, y, z, yaw = start, start + 1, start + 2, start + 3
    climb, scale = start + s.CLIMB, start + s.SCALE
    turn = aux[s.YAW_RATE] * dt
    heading = mean[yaw] + 0.5 * turn
    c, n = math.cos(heading) * p[s.VELOCITY_GAIN] * dt, math.sin(heading) * p[s.VELOCITY_GAIN] * dt
    unit_x, unit_y = c * aux[s.HELD_VX] - n * aux[s.HELD_VY], n * aux[s.HELD_VX] + c * aux[s.HELD_VY]
    dx, dy = mean[scale] * unit_x, mean[scale] * unit_y
    mean[x] += dx
    mean[y] += dy
    mean[z] += mean[climb] * dt + p[s.HAS_CLIMB_RATE] * aux[s.HELD_VZ] * dt
    mean[yaw] = wrap(mean[yaw] + turn)
    add_row(P, x, yaw, -dy)
    add_row(P, x, scale, unit_x)
    add_row(P, y, yaw, dx)
    add_row(P, y, scale, unit_y)
    add_row(P, z, climb, dt)
    add_column(P, start, x, yaw, -dy)
    add_column(P, start, x, scale, unit_x)
    add_column(P, start, y, yaw, dx)
    add_column(P, start, y, scale, unit_y)
    add_column(P, start, z, climb, dt)
    fade(mean, P, start, s.CLIMB, p[s.CLIMB_STD], dt / p[s.CLIMB_TAU])
    fade(mean, P, start, s.ROLL_ERROR, p[s.ATTITUDE_STD], dt / p[s.ATTITUDE_TAU])
    fade(mean, P, start, s.PITCH_ERROR, p[s.ATTITUDE_STD], dt / p[s.ATTITUDE_TAU])
    fade(mean, P, start, s.HEIGHT_ERROR, p[s.HEIGHT_STD], dt / p[s.HEIGHT_TAU])
    add_robot_noise(P, start, p, aux, dt, turn)
    mirror(P, start, s.MAX_BLOCK)


@kernel("void(float64[::1], float64[:,::1], int64, float64[::1], float64)")
def predict_constant_velocity(mean: Array, P: Array, start: int, p: Array, dt: float) -> None:
    """Move a target at constant velocity; white acceleration of the given density [m^2/s^3]."""
    q = p[s.ACCELERATION_DENSITY]
    for axis in range(2):
        position, velocity = start + axis, start + 2 + axis
        mean[position] += dt * mean[velocity]
        add_row(P, position, velocity, dt)
    for axis in range(2):
        position, velocity = start + axis, start + 2 + axis
        for i in range(start, start + 4):
            P[i, position] += dt * P[i, velocity]
        P[position, position] += q * dt**3 / 3.0
        P[position, velocity] += 0.5 * q * dt * dt
        P[velocity, position] += 0.5 * q * dt * dt
        P[velocity, velocity] += q * dt
    mirror(P, start, 4)


@kernel("void(float64[:,::1], int64, float64[::1], float64)")
def predict_fixed_mount(P: Array, start: int, p: Array, dt: float) -> None:
    """Let what is known of a fixed camera's mounting fade very slowly: mountings creep."""
    for i in range(3):
        P[start + i, start + i] += p[s.POSITION_DRIFT] * dt
        P[start + 3 + i, start + 3 + i] += p[s.ANGLE_DRIFT] * dt


@kernel("void(float64[::1], float64[:,::1], int64[:,::1], float64[:,::1], float64[:,::1], float64)")
def predict(mean: Array, P: Array, entities: IntArray, parameters: Array, aux: Array, dt: float) -> None:
    """Predict all active entities; the one place where motion models are told apart."""
    for e in range(entities.shape[0]):
        if aux[e, s.ACTIVE] == 0.0:
            continue
        if entities[e, s.ENTITY_MODEL] == s.ODOMETRY_ROBOT:
            predict_odometry_robot(mean, P, entities[e, s.ENTITY_START], parameters[e], aux[e], dt)
        elif entities[e, s.ENTITY_MODEL] == s.CONSTANT_VELOCITY:
            predict_constant_velocity(mean, P, entities[e, s.ENTITY_START], parameters[e], dt)
        else:
            predict_fixed_mount(P, entities[e, s.ENTITY_START], parameters[e], dt)


@kernel("void(float64[::1], float64[:,::1], int64[::1])")
def clear(mean: Array, P: Array, entity: IntArray) -> None:
    """Take an entity out of the state: zero mean, and no covariance with anything."""
    for i in range(entity[s.ENTITY_START], entity[s.ENTITY_START] + entity[s.ENTITY_SIZE]):
        mean[i] = 0.0
        for j in range(P.shape[0]):
            P[i, j] = 0.0
            P[j, i] = 0.0


@kernel("void(float64[::1], float64[:,::1], int64[::1], float64[::1], float64[::1])")
def join(mean: Array, P: Array, entity: IntArray, p: Array, pose: Array) -> None:
    """Put an entity into the state at a pose (x, y, z, yaw) with a diffuse prior, for the correction that follows.

    The correction turns the diffuse prior into the right covariance and cross-covariances by itself.
    """
    clear(mean, P, entity)
    start = entity[s.ENTITY_START]
    for i in range(2):
        mean[start + i] = pose[i]
        P[start + i, start + i] = DIFFUSE_M2
    if entity[s.ENTITY_MODEL] == s.ODOMETRY_ROBOT:
        mean[start + s.Z], mean[start + s.YAW], mean[start + s.SCALE] = pose[2], pose[3], 1.0
        P[start + s.Z, start + s.Z] = DIFFUSE_M2
        P[start + s.YAW, start + s.YAW] = DIFFUSE_RAD2
        P[start + s.CLIMB, start + s.CLIMB] = p[s.CLIMB_STD] ** 2
        P[start + s.SCALE, start + s.SCALE] = p[s.SCALE_STD] ** 2
        P[start + s.ROLL_ERROR, start + s.ROLL_ERROR] = p[s.ATTITUDE_STD] ** 2
        P[start + s.PITCH_ERROR, start + s.PITCH_ERROR] = p[s.ATTITUDE_STD] ** 2
        P[start + s.HEIGHT_ERROR, start + s.HEIGHT_ERROR] = p[s.HEIGHT_STD] ** 2
    else:
        P[start + s.VX, start + s.VX] = p[s.SPEED_STD] ** 2
        P[start + s.VY, start + s.VY] = p[s.SPEED_STD] ** 2
