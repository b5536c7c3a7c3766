"""A vehicle driven by its own velocity and heading increments; slow errors of its sensors are states."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from groundstation.arrays import Array, Matrix, Vector
from groundstation.estimation.filter_state import Belief, Deferred
from groundstation.estimation.layout import ROBOT_CORE, EntityKind
from groundstation.estimation.linear import wrap
from groundstation.estimation.model_kernels import MotionKernels
from groundstation.estimation.models.driven import (
    SILENT_DENSITY,
    SILENT_TURN_DENSITY,
    hold_velocity,
    position_density,
    take_heading,
    world_velocity,
)
from groundstation.estimation.models.height import EVEN_M, HeightEntries, correct_height
from groundstation.estimation.models.protocol import Vector3, place_of
from groundstation.estimation.motion import Dependence, add_column, depend, depend_on_two, fade, mirror, wander
from groundstation.estimation.records import YAW, CondensedOdometry, EntityMemory, EntityRow, X, Y, Z, own_parameters
from groundstation.kernel import Record, kernel

AERIAL = ("roll_error", "pitch_error", "climb", "velocity_scale", "height_error", "floor")
SLOW_STATES = (*AERIAL, "velocity_bias_x", "velocity_bias_y", "yaw_offset")
_TURN_SHARE = 0.02  # of each turn is in error
_BELIEVABLE, _WRONG = 3.0, 5.0  # deviations beyond which an error lasts longer, and beyond which the sensor lies
_LIE_S, _UNSEEN_LIE_S, _UNSEEN_S = 2.0, 8.0, 0.5  # how long a lie lasts, seen and unseen, and from when on it is unseen
# The field file's figure is what a vehicle states while it does not doubt itself; the lasting part of it is 0.6.
_STATED_ROOM = 2.0
_WALKS_AFTER_S = 0.2  # sightings of a robot in view come sooner
_DOUBT_S = 1.0  # the doubt that surprises raise is forgotten over this


class RobotParameters(Record):
    """Densities, deviations and correlation times of the errors, and where in the block the states of them stand.

    velocity_gain: true over reported speed; velocity_density [m^2/s], yaw_density and yaw_offset_density [rad^2/s],
    scale_density [1/s], floor_density [m^2/s]: white noise; *_std, *_tau_s: Gauss-Markov states; has_climb_rate: 1.0 if
    the vehicle reports one; height_variance [m^2]: of one step's height; velocity_std [m/s]: what the
    vehicle states beyond it is doubt; walk_density [m^2/s^3]: white noise of its error while nobody sees the vehicle;
    hold_s: how long a velocity holds in silence;
    at_*: entries (-1: the block has none).
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


_OWN_STATES = ("climb", "velocity_scale", "height_error", "floor", "velocity_bias_x", "velocity_bias_y")
_own = own_parameters(RobotParameters)


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
def turn_with_heading(P: Matrix, start: int, size: int, dx: float, dy: float) -> None:
    """Couple the position to the yaw by which a displacement was rotated."""
    for j in range(P.shape[0]):
        yaw = P[start + YAW, j]
        P[start, j] -= dy * yaw
        P[start + 1, j] += dx * yaw
    add_column(P, start, size, start, start + YAW, -dy)
    add_column(P, start, size, start + 1, start + YAW, dx)


@kernel(inlined=True)
def fade_velocity_bias(
    mean: Vector, P: Matrix, entity: EntityRow, p: RobotParameters, memory: EntityMemory, dt: float
) -> None:
    """Let the velocity's error decay over dt; one that no sound sensor has is given room, and stays longer.

    A heavy tail of its prior (0078): where sightings have drawn the error out of it, the deviation follows the error,
    so that the next ones count for more; surprises of fixed cameras add to it. Not so of an unseen robot (0143), whose
    error walks, where its kind's does.
    """
    start, size = entity.start, entity.size
    x, y = mean[start + p.at_velocity_bias_x], mean[start + p.at_velocity_bias_y]
    believable = _BELIEVABLE * _BELIEVABLE * p.bias_std * p.bias_std
    square, variance, lasts_s = x * x + y * y, p.bias_std * p.bias_std, p.bias_tau_s
    variance += memory.velocity_doubt * memory.velocity_doubt
    seen = memory.unseen_s < _UNSEEN_S
    if square > believable and seen:
        variance += square - believable
        lasts_s = max(lasts_s, lasts_s + (_LIE_S - lasts_s) * (1.0 - believable / square))
    if square > _WRONG * _WRONG * p.bias_std * p.bias_std and seen:
        memory.velocity_lie = max(memory.velocity_lie, math.sqrt(square - believable))
    memory.unseen_s += dt
    if memory.velocity_lie > 0.0:
        lie = memory.velocity_lie * memory.velocity_lie * min(1.0, memory.unseen_s / _UNSEEN_S)
        variance = max(variance, p.bias_std * p.bias_std + lie)
        lasts_s = max(lasts_s, lasts_s + (_UNSEEN_LIE_S - lasts_s) * lie / (lie + p.bias_std * p.bias_std))
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


@kernel()
def predict_odometry_robot(belief: Belief, e: int, dt: float) -> None:
    """Move a robot by its held odometry: velocity [base_stabilized] less bias, times gain, and its yaw rate.

    The scale state acts on the smoothed velocity: reported velocities are noisy, and a noisy regressor draws its
    factor down (by 0.2 here, were it the instantaneous one: what explains quick differences is mostly noise).

    PAPER (docs/explanation/method.md 7): the authors' program leaves out the derivative of the rotated velocity by yaw.
    """
    mean, P, entity, inputs = belief.mean, belief.P, belief.entities[e], belief.memory[e]
    start, size, p = entity.start, entity.size, _own(entity)
    climb, scale, bias_x, bias_y = p.at_climb, p.at_velocity_scale, p.at_velocity_bias_x, p.at_velocity_bias_y
    turn = inputs.yaw_rate * dt
    heading = mean[start + YAW] + 0.5 * turn
    c, n = math.cos(heading) * p.velocity_gain * dt, math.sin(heading) * p.velocity_gain * dt
    vx, vy = inputs.held_vx, inputs.held_vy
    if bias_x >= 0:
        vx, vy = vx - mean[start + bias_x], vy - mean[start + bias_y]
    slow_x, slow_y = inputs.slow_vx, inputs.slow_vy
    if scale >= 0:
        vx, vy = vx + (mean[start + scale] - 1.0) * slow_x, vy + (mean[start + scale] - 1.0) * slow_y
    dx, dy = c * vx - n * vy, n * vx + c * vy
    climb_rate = p.has_climb_rate * inputs.held_vz
    if climb >= 0:
        climb_rate += mean[start + climb]
    rate = 1.0 / dt
    inputs.velocity_x, inputs.velocity_y, inputs.velocity_z = dx * rate, dy * rate, climb_rate
    mean[start] += dx
    mean[start + 1] += dy
    mean[start + Z] += climb_rate * dt
    mean[start + YAW] = wrap(mean[start + YAW] + turn)
    turn_with_heading(P, start, size, dx, dy)
    if scale >= 0:
        depend(P, start, size, X, scale, c * slow_x - n * slow_y)
        depend(P, start, size, Y, scale, n * slow_x + c * slow_y)
    if bias_x >= 0:
        depend_on_two(P, start, size, X, Dependence(bias_x, -c, bias_y, n))
        depend_on_two(P, start, size, Y, Dependence(bias_x, -n, bias_y, -c))
    if climb >= 0:
        depend(P, start, size, Z, climb, dt)
    if size > len(ROBOT_CORE):
        fade_errors(mean, P, entity, p, inputs, dt)
    add_robot_noise(P, entity, p, inputs, dt, turn)
    mirror(P, start, size, 2 if size == 4 else size)


@kernel()
def begin_odometry_robot(
    belief: Belief, deferred: Deferred, odometry: CondensedOdometry, e: int, step_s: float, gate: float
) -> None:
    """Take the odometry of one step and, where the robot is in the state, correct by its height."""
    entity, memory = belief.entities[e], belief.memory[e]
    start, p = entity.start, _own(entity)
    hold_velocity(odometry, memory, p.hold_s, step_s)
    take_heading(odometry, memory, step_s)
    memory.velocity_doubt *= math.exp(-step_s / _DOUBT_S)
    if odometry.newest_velocity_std > p.velocity_std:
        # What the vehicle itself doubts is doubted for as long as it does.
        memory.velocity_doubt = max(memory.velocity_doubt, odometry.newest_velocity_std)
    if memory.active == 0 or memory.unconfirmed != 0 or odometry.height_count == 0.0:
        return
    error = start + p.at_height_error if p.at_height_error >= 0 else -1
    floor = start + p.at_floor if p.at_floor >= 0 else -1
    height = odometry.height_sum / odometry.height_count
    correct_height(belief, deferred, HeightEntries(start + Z, error, floor), height, p.height_variance, gate)


@dataclass(frozen=True, slots=True)
class OdometryRobot:
    """A vehicle driven by its own velocity and heading increments; slow errors of its sensors are states.

    slow_states: those of SLOW_STATES that this type of vehicle needs; without any the block is the paper's four.
    velocity_scale: true speed over reported speed as calibrated, known to `scale_std` (a state follows the rest);
    velocity_std_m_s with its correlation time becomes white noise; heading wanders by yaw_std_rad per root second;
    attitude, height and velocity errors are Gauss-Markov states; velocity_walk: change of the latter while nobody sees
    the vehicle [m/s per root second]; climb is a state where the vehicle reports none. floor is the height of what is
    below; yaw_offset what the vehicle's own heading is off by, for the heading sensor.
    """

    kind: ClassVar[EntityKind] = EntityKind.ROBOT
    kernels: ClassVar[MotionKernels] = MotionKernels(predict_odometry_robot, begin_odometry_robot)
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
    velocity_walk: float = 0.0
    yaw_offset_std_rad: float = math.pi
    yaw_offset_drift_rad: float = math.radians(0.6)
    slow_states: tuple[str, ...] = AERIAL
    admitted: bool = False

    @property
    def labels(self) -> tuple[str, ...]:
        """Return the entries of the block."""
        return (*ROBOT_CORE, *(label for label in SLOW_STATES if label in self.slow_states))

    @property
    def place_m(self) -> Vector3:
        """Return where the marker is."""
        return self.marker_position_m

    def own(self) -> RobotParameters:
        """Return the parameters that the kernels read."""
        return RobotParameters.row(
            velocity_gain=self.velocity_scale,
            velocity_density=self.velocity_std_m_s**2 * self.velocity_correlation_s,
            yaw_density=self.yaw_std_rad**2,
            yaw_offset_density=self.yaw_offset_drift_rad**2,
            scale_density=self.scale_drift**2,
            floor_density=EVEN_M**2 / 3600.0,
            climb_std=self.climb_std_m_s,
            climb_tau_s=self.climb_correlation_s,
            attitude_std=self.attitude_std_rad,
            attitude_tau_s=self.attitude_correlation_s,
            height_std=self.height_std_m,
            height_tau_s=self.height_correlation_s,
            bias_std=self.velocity_bias_std_m_s,
            bias_tau_s=self.velocity_bias_correlation_s,
            walk_density=self.velocity_walk**2,
            velocity_std=_STATED_ROOM * max(self.velocity_std_m_s, self.velocity_bias_std_m_s * self.velocity_scale),
            has_climb_rate=float(self.reports_climb),
            # The slow part of the error is a state; what is left is quick, and alike in neighbouring samples.
            height_variance=(0.5 * self.height_std_m) ** 2,
            hold_s=self.hold_s,
            **{f"at_{label}": place_of(self.labels, label) for label in _OWN_STATES},
        )

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

    def velocity_m_s(self, block: Array, memory: EntityMemory) -> Vector3:
        """Return the velocity [world] from the block's mean and the held odometry."""
        state = dict(zip(self.labels, block.tolist(), strict=True))
        rest = state.get("velocity_scale", 1.0) - 1.0
        vx = memory["held_vx"] + rest * memory["slow_vx"] - state.get("velocity_bias_x", 0.0)
        vy = memory["held_vy"] + rest * memory["slow_vy"] - state.get("velocity_bias_y", 0.0)
        forward, left = self.velocity_scale * vx, self.velocity_scale * vy
        climb = state.get("climb", 0.0) + float(self.reports_climb) * memory["held_vz"]
        return world_velocity(state["yaw"], forward, left, climb)
