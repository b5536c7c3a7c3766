"""A ground robot of which only the commanded speeds are known: it follows them late and never quite as told.

f: forward = (1 + forward_scale) v - turn_drag |w|, rate = (1 + turn_scale) w + turn_offset, on an arc during a step. It
answers a command `response_s` late (its odometry delay is minus that) and approaches it within `lag_s`. What its range
and bearing sensor is off by are states too.
"""

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
from groundstation.estimation.models.driven import hold_velocity, position_density, world_velocity
from groundstation.estimation.models.protocol import Vector3
from groundstation.estimation.motion import depend, fade, mirror

(
    SPEED_DENSITY,
    SLIP_DENSITY,
    RATE_DENSITY,
    SPEED_NOISE,
    TURN_NOISE,
    SCALE_STD,
    SCALE_TAU,
    TURN_SCALE_STD,
    OFFSET_STD,
    OFFSET_TAU,
    RANGE_STD,
    RANGE_TAU,
    BEARING_STD,
    BEARING_TAU,
    HOLD_S,
    LAG_S,
    DRAG_MEAN,
    DRAG_STD,
    RANGE_SCALE_STD,
    SWAY_NOISE,
) = range(s.FIRST_OWN, s.FIRST_OWN + 20)
FORWARD_SCALE, TURN_DRAG, TURN_SCALE, TURN_OFFSET, RANGE_BIAS, RANGE_SCALE, BEARING_BIAS = range(4, 11)
STANDS = 1e-3  # commands below are none [m/s, rad/s]


@kernel("void(float64[:,::1], int64, float64[::1], float64[::1], float64, float64, float64, float64)")
def add_drive_noise(
    P: Array, start: int, p: Array, aux: Array, heading: float, forward: float, rate: float, dt: float
) -> None:
    """Add the noise of driving: along the heading with the speed, across by slip, and of the heading with both."""
    idle = position_density(0.0, aux[s.ODOMETRY_AGE], p[HOLD_S])
    along = (p[SPEED_DENSITY] + p[SPEED_NOISE] * abs(forward) + idle) * dt
    across = (p[SLIP_DENSITY] * abs(forward) + idle) * dt + 1e-8 * dt
    c, n = math.cos(heading), math.sin(heading)
    P[start, start] += c * c * along + n * n * across
    P[start + 1, start + 1] += n * n * along + c * c * across
    P[start, start + 1] += c * n * (along - across)
    P[start + 1, start] += c * n * (along - across)
    P[start + s.YAW, start + s.YAW] += (p[RATE_DENSITY] + p[TURN_NOISE] * abs(rate) + p[SWAY_NOISE] * abs(forward)) * dt


@kernel(PREDICT)
def predict_commanded_robot(
    mean: Array, P: Array, entities: IntArray, parameters: Array, aux: Array, e: int, dt: float
) -> None:
    """Drive an arc at the commanded speeds, scaled; scales and offsets fade back to what the type is known for."""
    start, size, p = entities[e, s.ENTITY_START], entities[e, s.ENTITY_SIZE], parameters[e]
    v, w = aux[e, s.HELD_VX], aux[e, s.YAW_RATE]
    # A robot that is told to stand stands.
    moving = 1.0 if abs(v) > STANDS or abs(w) > STANDS else 0.0
    rate = (1.0 + mean[start + TURN_SCALE]) * w + moving * mean[start + TURN_OFFSET]
    drag = (p[DRAG_MEAN] + mean[start + TURN_DRAG]) * abs(w)
    forward = (1.0 + mean[start + FORWARD_SCALE]) * v - drag
    heading = mean[start + s.YAW] + 0.5 * rate * dt
    c, n = math.cos(heading) * dt, math.sin(heading) * dt
    mean[start] += c * forward
    mean[start + 1] += n * forward
    mean[start + s.YAW] = wrap(mean[start + s.YAW] + rate * dt)
    depend(P, start, size, s.X, s.YAW, -n * forward)
    depend(P, start, size, s.Y, s.YAW, c * forward)
    depend(P, start, size, s.X, FORWARD_SCALE, c * v)
    depend(P, start, size, s.Y, FORWARD_SCALE, n * v)
    depend(P, start, size, s.X, TURN_DRAG, -c * abs(w))
    depend(P, start, size, s.Y, TURN_DRAG, -n * abs(w))
    depend(P, start, size, s.X, TURN_SCALE, -0.5 * dt * w * n * forward)
    depend(P, start, size, s.Y, TURN_SCALE, 0.5 * dt * w * c * forward)
    depend(P, start, size, s.X, TURN_OFFSET, -0.5 * dt * n * forward * moving)
    depend(P, start, size, s.Y, TURN_OFFSET, 0.5 * dt * c * forward * moving)
    depend(P, start, size, s.YAW, TURN_SCALE, dt * w)
    depend(P, start, size, s.YAW, TURN_OFFSET, dt * moving)
    fade(mean, P, start, size, FORWARD_SCALE, p[SCALE_STD], dt / p[SCALE_TAU])
    fade(mean, P, start, size, TURN_DRAG, p[DRAG_STD], dt / p[SCALE_TAU])
    fade(mean, P, start, size, TURN_SCALE, p[TURN_SCALE_STD], dt / p[SCALE_TAU])
    fade(mean, P, start, size, TURN_OFFSET, p[OFFSET_STD], dt / p[OFFSET_TAU])
    fade(mean, P, start, size, RANGE_BIAS, p[RANGE_STD], dt / p[RANGE_TAU])
    fade(mean, P, start, size, RANGE_SCALE, p[RANGE_SCALE_STD], dt / p[RANGE_TAU])
    fade(mean, P, start, size, BEARING_BIAS, p[BEARING_STD], dt / p[BEARING_TAU])
    add_drive_noise(P, start, p, aux[e], heading, forward, rate, dt)
    mirror(P, start, size, size)


@kernel(BEGIN)
def begin_commanded_robot(
    mean: Array, P: Array, entities: IntArray, parameters: Array, aux: Array, odometry: Array, e: int, step: float,
    gate: float,
) -> None:  # fmt: skip
    """Let the robot's speeds approach those that were commanded for this step."""
    forward, rate = aux[e, s.HELD_VX], aux[e, s.YAW_RATE]
    hold_velocity(odometry[e], aux[e], parameters[e, HOLD_S], step)
    if odometry[e, s.VELOCITY_COUNT] > 0.0:
        aux[e, s.LAST_VX], aux[e, s.LAST_RATE] = aux[e, s.HELD_VX], aux[e, s.YAW_RATE]
    elif aux[e, s.ODOMETRY_AGE] > parameters[e, HOLD_S]:
        aux[e, s.LAST_VX] = aux[e, s.LAST_RATE] = 0.0
    share = 1.0 - math.exp(-step / parameters[e, LAG_S])
    aux[e, s.HELD_VX] = forward + share * (aux[e, s.LAST_VX] - forward)
    aux[e, s.YAW_RATE] = rate + share * (aux[e, s.LAST_RATE] - rate)


@dataclass(frozen=True, slots=True)
class CommandedRobot:
    """A ground robot driven by commanded forward speed and turn rate (`Motion.velocity_m_s[0]`, `yaw_rate_rad_s`).

    Scales, offsets and biases are Gauss-Markov states about zero with the given deviations and correlation times.
    speed_std_m_s: of the speed error that is there at any speed (zero: none while it stands); speed_noise, slip_noise:
    variance of the way along and across per metre driven [m]; turn_noise: of the heading per radian turned [rad].
    """

    kind: ClassVar[EntityKind] = EntityKind.ROBOT
    labels: ClassVar[tuple[str, ...]] = (
        *ROBOT_CORE,
        "forward_scale",
        "turn_drag",
        "turn_scale",
        "turn_offset",
        "range_bias",
        "range_scale",
        "bearing_bias",
    )
    kernels: ClassVar[tuple[int, int]] = (address_of(predict_commanded_robot), address_of(begin_commanded_robot))
    present: ClassVar[bool] = False
    admitted: ClassVar[bool] = True

    marker_position_m: Vector3 = (0.0, 0.0, 0.0)
    response_s: float = 0.1
    lag_s: float = 0.12
    speed_noise_m: float = 0.002
    slip_noise_m: float = 0.0005
    speed_density: float = 0.0
    turn_noise_rad: float = 0.02
    sway_noise: float = 0.002
    rate_density: float = 1e-7
    scale_std: float = 0.1
    turn_scale_std: float = 0.1
    scale_correlation_s: float = 300.0
    turn_drag_m: float = 0.05
    turn_drag_std_m: float = 0.05
    offset_std_rad_s: float = 0.01
    offset_correlation_s: float = 60.0
    range_bias_std_m: float = 0.05
    range_scale_std: float = 0.03
    range_bias_correlation_s: float = 300.0
    bearing_bias_std_rad: float = 0.015
    bearing_bias_correlation_s: float = 300.0
    hold_s: float = 1.0

    @property
    def velocity_delay_s(self) -> float:
        """Return how late a command's stamp is for what the robot does: it acts after it."""
        return -self.response_s

    @property
    def height_delay_s(self) -> float:
        """Return nothing: there is no height sensor."""
        return 0.0

    def row(self) -> Array:
        """Return the parameters in the columns that the kernels read."""
        row = np.zeros(s.PARAMETER_COLUMNS)
        row[:3] = self.marker_position_m
        row[SPEED_DENSITY], row[RATE_DENSITY] = self.speed_density, self.rate_density
        row[SPEED_NOISE], row[SLIP_DENSITY], row[TURN_NOISE] = (
            self.speed_noise_m,
            self.slip_noise_m,
            self.turn_noise_rad,
        )
        row[SCALE_STD], row[SCALE_TAU], row[TURN_SCALE_STD] = (
            self.scale_std,
            self.scale_correlation_s,
            self.turn_scale_std,
        )
        row[OFFSET_STD], row[OFFSET_TAU] = self.offset_std_rad_s, self.offset_correlation_s
        row[SWAY_NOISE] = self.sway_noise
        row[RANGE_SCALE_STD] = self.range_scale_std
        row[RANGE_STD], row[RANGE_TAU] = self.range_bias_std_m, self.range_bias_correlation_s
        row[BEARING_STD], row[BEARING_TAU] = self.bearing_bias_std_rad, self.bearing_bias_correlation_s
        row[HOLD_S], row[LAG_S] = self.hold_s, self.lag_s
        row[DRAG_MEAN], row[DRAG_STD] = self.turn_drag_m, self.turn_drag_std_m
        return row

    def prior(self) -> Array:
        """Return mean and variances (2, size) of what joins."""
        deviations = (
            self.scale_std,
            self.turn_drag_std_m,
            self.turn_scale_std,
            self.offset_std_rad_s,
            self.range_bias_std_m,
            self.range_scale_std,
            self.bearing_bias_std_rad,
        )
        return np.array([[0.0] * 11, [0.0] * 4 + [d * d for d in deviations]])

    def velocity_m_s(self, block: Array, aux: Array) -> Vector3:
        """Return the velocity [world] from the block's mean and the held command."""
        return world_velocity(block[s.YAW], (1.0 + block[FORWARD_SCALE]) * aux[s.HELD_VX], 0.0, 0.0)
