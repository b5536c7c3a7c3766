"""A vehicle driven by its own velocity and heading increments; slow errors of its sensors are states."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.dispatch import BEGIN, PREDICT
from groundstation.estimation.kernel import address_of, kernel
from groundstation.estimation.layout import ROBOT_CORE, EntityKind
from groundstation.estimation.linear import wrap
from groundstation.estimation.models.driven import hold_velocity, position_density, take_heading, world_velocity
from groundstation.estimation.models.height import EVEN_M, correct_height
from groundstation.estimation.models.protocol import Vector3, place_of
from groundstation.estimation.motion import add_column, depend, fade, mirror, wander

(
    VELOCITY_GAIN,
    VELOCITY_DENSITY,
    YAW_DENSITY,
    SCALE_DENSITY,
    CLIMB_STD,
    CLIMB_TAU,
    ATTITUDE_STD,
    ATTITUDE_TAU,
    HAS_CLIMB_RATE,
    HEIGHT_VARIANCE,
    HEIGHT_STD,
    HEIGHT_TAU,
    HOLD_S,
    BIAS_STD,
    BIAS_TAU,
    FLOOR_DENSITY,
    YAW_OFFSET_DENSITY,
    AT_CLIMB,
    AT_SCALE,
    AT_HEIGHT_ERROR,
    AT_FLOOR,
    AT_BIAS_X,
    AT_BIAS_Y,
) = range(s.FIRST_OWN, s.FIRST_OWN + 23)

SLOW_STATES = (
    "roll_error",
    "pitch_error",
    "climb",
    "velocity_scale",
    "height_error",
    "floor",
    "velocity_bias_x",
    "velocity_bias_y",
    "yaw_offset",
)
AERIAL = SLOW_STATES[:6]
_TURN_SHARE = 0.02  # of each turn is in error


@kernel("void(float64[:,::1], int64[::1], float64[::1], float64[::1], float64, float64)", inlined=True)
def add_robot_noise(P: Array, entity: IntArray, p: Array, aux: Array, dt: float, turn: float) -> None:
    """Add the process noise of an odometry-driven robot over dt, in which it turned by `turn`."""
    start = entity[s.ENTITY_START]
    density = position_density(p[VELOCITY_DENSITY], aux[s.ODOMETRY_AGE], p[HOLD_S])
    climbing = 1e-6 if p[AT_CLIMB] >= 0.0 or p[HAS_CLIMB_RATE] != 0.0 else p[CLIMB_STD] * p[CLIMB_STD] * p[CLIMB_TAU]
    P[start, start] += density * dt
    P[start + 1, start + 1] += density * dt
    wander(P, start, s.Z, climbing * dt)
    wander(P, start, s.YAW, p[YAW_DENSITY] * dt + _TURN_SHARE * _TURN_SHARE * turn * turn)
    wander(P, start, int(p[AT_SCALE]), p[SCALE_DENSITY] * dt)
    wander(P, start, int(p[AT_FLOOR]), p[FLOOR_DENSITY] * dt)
    wander(P, start, entity[s.AT_YAW_OFFSET], p[YAW_OFFSET_DENSITY] * dt)


@kernel("void(float64[:,::1], int64, int64, float64, float64)", inlined=True)
def turn_with_heading(P: Array, start: int, size: int, dx: float, dy: float) -> None:
    """Couple the position to the yaw by which a displacement was rotated."""
    for j in range(P.shape[0]):
        yaw = P[start + s.YAW, j]
        P[start, j] -= dy * yaw
        P[start + 1, j] += dx * yaw
    add_column(P, start, size, start, start + s.YAW, -dy)
    add_column(P, start, size, start + 1, start + s.YAW, dx)


@kernel("void(float64[::1], float64[:,::1], int64[::1], float64[::1], float64)")
def fade_errors(mean: Array, P: Array, entity: IntArray, p: Array, dt: float) -> None:
    """Let all Gauss-Markov entries that the block has decay over dt."""
    start, size = entity[s.ENTITY_START], entity[s.ENTITY_SIZE]
    fade(mean, P, start, size, int(p[AT_CLIMB]), p[CLIMB_STD], dt / p[CLIMB_TAU])
    fade(mean, P, start, size, entity[s.AT_ROLL_ERROR], p[ATTITUDE_STD], dt / p[ATTITUDE_TAU])
    fade(mean, P, start, size, entity[s.AT_PITCH_ERROR], p[ATTITUDE_STD], dt / p[ATTITUDE_TAU])
    fade(mean, P, start, size, int(p[AT_HEIGHT_ERROR]), p[HEIGHT_STD], dt / p[HEIGHT_TAU])
    fade(mean, P, start, size, int(p[AT_BIAS_X]), p[BIAS_STD], dt / p[BIAS_TAU])
    fade(mean, P, start, size, int(p[AT_BIAS_Y]), p[BIAS_STD], dt / p[BIAS_TAU])


@kernel(PREDICT)
def predict_odometry_robot(
    mean: Array, P: Array, entities: IntArray, parameters: Array, aux: Array, e: int, dt: float
) -> None:
    """Move a robot by its held odometry: velocity [base_stabilized] less bias, times gain, and its yaw rate.

    The scale state acts on the smoothed velocity: reported velocities are noisy, and a noisy regressor draws its
    factor down (by 0.2 here, were it the instantaneous one: what explains quick differences is mostly noise).

    PAPER: departs from the authors' program, which leaves out the derivative of the rotated velocity by yaw.
    """
    entity, p, inputs = entities[e], parameters[e], aux[e]
    start, size = entity[s.ENTITY_START], entity[s.ENTITY_SIZE]
    climb, scale, bias_x, bias_y = int(p[AT_CLIMB]), int(p[AT_SCALE]), int(p[AT_BIAS_X]), int(p[AT_BIAS_Y])
    turn = inputs[s.YAW_RATE] * dt
    heading = mean[start + s.YAW] + 0.5 * turn
    c, n = math.cos(heading) * p[VELOCITY_GAIN] * dt, math.sin(heading) * p[VELOCITY_GAIN] * dt
    vx, vy = inputs[s.HELD_VX], inputs[s.HELD_VY]
    if bias_x >= 0:
        vx, vy = vx - mean[start + bias_x], vy - mean[start + bias_y]
    slow_x, slow_y = inputs[s.SLOW_VX], inputs[s.SLOW_VY]
    if scale >= 0:
        vx, vy = vx + (mean[start + scale] - 1.0) * slow_x, vy + (mean[start + scale] - 1.0) * slow_y
    dx, dy = c * vx - n * vy, n * vx + c * vy
    climb_rate = p[HAS_CLIMB_RATE] * inputs[s.HELD_VZ]
    if climb >= 0:
        climb_rate += mean[start + climb]
    rate = 1.0 / dt
    inputs[s.RATE_X], inputs[s.RATE_Y], inputs[s.RATE_Z] = dx * rate, dy * rate, climb_rate
    mean[start] += dx
    mean[start + 1] += dy
    mean[start + s.Z] += climb_rate * dt
    mean[start + s.YAW] = wrap(mean[start + s.YAW] + turn)
    turn_with_heading(P, start, size, dx, dy)
    if scale >= 0:
        depend(P, start, size, s.X, scale, c * slow_x - n * slow_y)
        depend(P, start, size, s.Y, scale, n * slow_x + c * slow_y)
    if bias_x >= 0:
        depend(P, start, size, s.X, bias_x, -c)
        depend(P, start, size, s.X, bias_y, n)
        depend(P, start, size, s.Y, bias_x, -n)
        depend(P, start, size, s.Y, bias_y, -c)
    if climb >= 0:
        depend(P, start, size, s.Z, climb, dt)
    if size > len(ROBOT_CORE):
        fade_errors(mean, P, entity, p, dt)
    add_robot_noise(P, entity, p, inputs, dt, turn)
    mirror(P, start, size, 2 if size == 4 else size)


@kernel(BEGIN)
def begin_odometry_robot(
    mean: Array, P: Array, entities: IntArray, parameters: Array, aux: Array, odometry: Array, e: int, step: float,
    gate: float,
) -> None:  # fmt: skip
    """Take the odometry of one step and, where the robot is in the state, correct by its height."""
    p, condensed = parameters[e], odometry[e]
    hold_velocity(condensed, aux[e], p[HOLD_S], step)
    take_heading(condensed, aux[e], step)
    if aux[e, s.ACTIVE] == 0.0 or aux[e, s.UNCONFIRMED] != 0.0 or condensed[s.HEIGHT_COUNT] == 0.0:
        return
    start = entities[e, s.ENTITY_START]
    error = start + int(p[AT_HEIGHT_ERROR]) if p[AT_HEIGHT_ERROR] >= 0.0 else -1
    floor = start + int(p[AT_FLOOR]) if p[AT_FLOOR] >= 0.0 else -1
    height = condensed[s.HEIGHT_SUM] / condensed[s.HEIGHT_COUNT]
    correct_height(mean, P, start + s.Z, error, floor, height, p[HEIGHT_VARIANCE], gate)


@dataclass(frozen=True, slots=True)
class OdometryRobot:
    """A vehicle driven by its own velocity and heading increments; slow errors of its sensors are states.

    slow_states: those of SLOW_STATES that this type of vehicle needs; without any the block is the paper's four.
    velocity_scale: true speed over reported speed as calibrated, known to `scale_std` (a state follows the rest);
    velocity_std_m_s with its correlation time becomes white noise; heading wanders by yaw_std_rad per root second;
    attitude, height and velocity errors are Gauss-Markov states; climb is one where the vehicle reports none. floor is
    the height of what is below; yaw_offset what the vehicle's own heading is off by, for the heading sensor.
    """

    kind: ClassVar[EntityKind] = EntityKind.ROBOT
    kernels: ClassVar[tuple[int, int]] = (address_of(predict_odometry_robot), address_of(begin_odometry_robot))
    present: ClassVar[bool] = False

    marker_position_m: Vector3 = (0.0, 0.0, 0.08)
    velocity_scale: float = 1.0
    scale_std: float = 0.10
    scale_drift: float = 0.005
    velocity_std_m_s: float = 0.05
    velocity_correlation_s: float = 0.2
    velocity_delay_s: float = 0.03
    yaw_std_rad: float = math.radians(1.0)
    attitude_std_rad: float = math.radians(1.0)
    attitude_correlation_s: float = 5.0
    height_std_m: float = 0.04
    height_correlation_s: float = 2.0
    height_delay_s: float = 0.085
    climb_std_m_s: float = 0.08
    climb_correlation_s: float = 0.7
    reports_climb: bool = False
    hold_s: float = 0.2
    velocity_bias_std_m_s: float = 0.0
    velocity_bias_correlation_s: float = 2.0
    yaw_offset_std_rad: float = math.pi
    yaw_offset_drift_rad: float = math.radians(0.6)
    slow_states: tuple[str, ...] = AERIAL
    admitted: bool = False

    @property
    def labels(self) -> tuple[str, ...]:
        """Return the entries of the block."""
        return (*ROBOT_CORE, *(label for label in SLOW_STATES if label in self.slow_states))

    def row(self) -> Array:
        """Return the parameters in the columns that the kernels read."""
        row = np.zeros(s.PARAMETER_COLUMNS)
        row[:3] = self.marker_position_m
        row[VELOCITY_GAIN] = self.velocity_scale
        row[VELOCITY_DENSITY] = self.velocity_std_m_s**2 * self.velocity_correlation_s
        row[YAW_DENSITY], row[YAW_OFFSET_DENSITY] = self.yaw_std_rad**2, self.yaw_offset_drift_rad**2
        row[SCALE_DENSITY] = self.scale_drift**2
        row[CLIMB_STD], row[CLIMB_TAU] = self.climb_std_m_s, self.climb_correlation_s
        row[ATTITUDE_STD], row[ATTITUDE_TAU] = self.attitude_std_rad, self.attitude_correlation_s
        row[HEIGHT_STD], row[HEIGHT_TAU] = self.height_std_m, self.height_correlation_s
        row[BIAS_STD], row[BIAS_TAU] = self.velocity_bias_std_m_s, self.velocity_bias_correlation_s
        # The slow part of the error is a state; what is left is quick, and alike in neighbouring samples.
        row[HEIGHT_VARIANCE] = (0.5 * self.height_std_m) ** 2
        row[FLOOR_DENSITY] = EVEN_M**2 / 3600.0
        row[HAS_CLIMB_RATE], row[HOLD_S] = float(self.reports_climb), self.hold_s
        labels = ("climb", "velocity_scale", "height_error", "floor", "velocity_bias_x", "velocity_bias_y")
        row[AT_CLIMB : AT_BIAS_Y + 1] = [place_of(self.labels, label) for label in labels]
        return row

    def prior(self) -> Array:
        """Return mean and variances (2, size) of the slow states when it joins."""
        deviations = {
            "roll_error": self.attitude_std_rad,
            "pitch_error": self.attitude_std_rad,
            "climb": self.climb_std_m_s,
            "velocity_scale": self.scale_std,
            "height_error": self.height_std_m,
            "floor": EVEN_M,
            "velocity_bias_x": self.velocity_bias_std_m_s,
            "velocity_bias_y": self.velocity_bias_std_m_s,
            "yaw_offset": self.yaw_offset_std_rad,
        }
        means = [float(label == "velocity_scale") for label in self.labels]
        return np.array([means, [deviations.get(label, 0.0) ** 2 for label in self.labels]])

    def velocity_m_s(self, block: Array, aux: Array) -> Vector3:
        """Return the velocity [world] from the block's mean and the held odometry."""
        state = dict(zip(self.labels, block, strict=True))
        rest = state.get("velocity_scale", 1.0) - 1.0
        vx = aux[s.HELD_VX] + rest * aux[s.SLOW_VX] - state.get("velocity_bias_x", 0.0)
        vy = aux[s.HELD_VY] + rest * aux[s.SLOW_VY] - state.get("velocity_bias_y", 0.0)
        forward, left = self.velocity_scale * vx, self.velocity_scale * vy
        climb = state.get("climb", 0.0) + float(self.reports_climb) * aux[s.HELD_VZ]
        return world_velocity(block[s.YAW], forward, left, climb)
