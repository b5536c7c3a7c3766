"""Dynamics of the errors of a vehicle's own sensors: growth, decay and time constants."""

import math

from groundstation.arrays import Matrix, Vector
from groundstation.estimation.models.driven import SILENT_DENSITY, SILENT_TURN_DENSITY, position_density
from groundstation.estimation.motion import fade, wander
from groundstation.estimation.records import YAW, EntityMemory, EntityRow, Z
from groundstation.kernel import Record, kernel

_TURN_SHARE = 0.02  # of each turn is in error
_BELIEVABLE, _WRONG = 3.0, 5.0  # deviations beyond which an error lasts longer, and the sensor counts as wrong
_ERROR_S, _UNSEEN_ERROR_S, _UNSEEN_S = 2.0, 8.0, 0.5  # duration of a wrong velocity, seen and unseen; unseen after
_WALKS_AFTER_S = 0.2  # a robot in view is seen more often


class RobotParameters(Record):
    """Densities, deviations and correlation times of the errors, and the indices of their states in the block.

    velocity_gain: true over reported speed; velocity_density [m^2/s], yaw_density and yaw_offset_density [rad^2/s],
    scale_density [1/s], floor_density [m^2/s]: white noise; *_std, *_tau_s: Gauss-Markov states; has_climb_rate: 1.0 if
    the vehicle reports one; height_variance [m^2]: of one step's height; velocity_std [m/s]: a larger stated deviation
    is doubt; walk_density [m^2/s^3]: white noise of the velocity's error while the vehicle is unseen; hold_s: how long
    a velocity holds in silence; at_*: entries (-1: the block has none).
    """

    velocity_gain: float
    velocity_density: float
    yaw_density: float
    yaw_offset_density: float
    scale_density: float
    floor_density: float
    climb_std: float
    climb_tau_s: float
    attitude_std: float
    attitude_tau_s: float
    height_std: float
    height_tau_s: float
    bias_std: float
    bias_tau_s: float
    velocity_std: float
    walk_density: float
    has_climb_rate: float
    height_variance: float
    hold_s: float
    at_climb: int
    at_velocity_scale: int
    at_height_error: int
    at_floor: int
    at_velocity_bias_x: int
    at_velocity_bias_y: int


@kernel(inlined=True)
def add_robot_noise(
    P: Matrix, entity: EntityRow, p: RobotParameters, memory: EntityMemory, dt: float, turn: float
) -> None:
    """Add the process noise of an odometry-driven robot over dt, in which it turned by `turn`."""
    start = entity.start
    density = position_density(p.velocity_density, memory.odometry_age_s, p.hold_s)
    turning = memory.yaw_std * memory.yaw_std if memory.yaw_std > 0.0 else p.yaw_density
    climbing = 1e-6 if p.at_climb >= 0 or p.has_climb_rate != 0.0 else p.climb_std * p.climb_std * p.climb_tau_s
    if memory.odometry_age_s > p.hold_s:
        turning += SILENT_TURN_DENSITY
        climbing += SILENT_DENSITY if p.at_climb < 0 else 0.0
    P[start, start] += density * dt
    P[start + 1, start + 1] += density * dt
    wander(P, start, Z, climbing * dt)
    wander(P, start, YAW, turning * dt + _TURN_SHARE * _TURN_SHARE * turn * turn)
    wander(P, start, p.at_velocity_scale, p.scale_density * dt)
    wander(P, start, p.at_floor, p.floor_density * dt)
    wander(P, start, entity.at_yaw_offset, p.yaw_offset_density * dt)


@kernel(inlined=True)
def fade_velocity_bias(
    mean: Vector, P: Matrix, entity: EntityRow, p: RobotParameters, memory: EntityMemory, dt: float
) -> None:
    """Let the velocity's error decay over dt.

    An error too large for a sound sensor gets more variance, and lasts longer. Its prior has a heavy tail (0078): once
    sightings have moved the error beyond its prior, the deviation follows the error, so that the next sightings weigh
    more; sightings of fixed cameras beyond the gate add to it. Not for an unseen robot (0143), whose error is a random
    walk if its kind's is.
    """
    start, size = entity.start, entity.size
    x, y = mean[start + p.at_velocity_bias_x], mean[start + p.at_velocity_bias_y]
    believable = _BELIEVABLE * _BELIEVABLE * p.bias_std * p.bias_std
    square, variance, lasts_s = x * x + y * y, p.bias_std * p.bias_std, p.bias_tau_s
    variance += memory.velocity_doubt * memory.velocity_doubt
    seen = memory.unseen_s < _UNSEEN_S
    if square > believable and seen:
        variance += square - believable
        lasts_s = max(lasts_s, lasts_s + (_ERROR_S - lasts_s) * (1.0 - believable / square))
    if square > _WRONG * _WRONG * p.bias_std * p.bias_std and seen:
        memory.noted_error = max(memory.noted_error, math.sqrt(square - believable))
    if memory.noted_error > 0.0:
        noted = memory.noted_error * memory.noted_error * min(1.0, memory.unseen_s / _UNSEEN_S)
        variance = max(variance, p.bias_std * p.bias_std + noted)
        lasts_s = max(lasts_s, lasts_s + (_UNSEEN_ERROR_S - lasts_s) * noted / (noted + p.bias_std * p.bias_std))
    deviation = math.sqrt(variance)
    fade(mean, P, start, size, p.at_velocity_bias_x, deviation, dt / lasts_s)
    fade(mean, P, start, size, p.at_velocity_bias_y, deviation, dt / lasts_s)
    if memory.unseen_s > _WALKS_AFTER_S:
        wander(P, start, p.at_velocity_bias_x, p.walk_density * dt)
        wander(P, start, p.at_velocity_bias_y, p.walk_density * dt)


@kernel()
def fade_errors(
    mean: Vector, P: Matrix, entity: EntityRow, p: RobotParameters, memory: EntityMemory, dt: float
) -> None:
    """Let all Gauss-Markov entries that the block has decay over dt."""
    start, size = entity.start, entity.size
    attitude_std = memory.attitude_std if memory.attitude_std > 0.0 else p.attitude_std
    fade(mean, P, start, size, p.at_climb, p.climb_std, dt / p.climb_tau_s)
    fade(mean, P, start, size, entity.at_roll_error, attitude_std, dt / p.attitude_tau_s)
    fade(mean, P, start, size, entity.at_pitch_error, attitude_std, dt / p.attitude_tau_s)
    fade(mean, P, start, size, p.at_height_error, p.height_std, dt / p.height_tau_s)
    if p.at_velocity_bias_x >= 0:
        fade_velocity_bias(mean, P, entity, p, memory, dt)
