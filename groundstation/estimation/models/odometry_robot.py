"""A vehicle driven by its own velocity and heading increments; slow errors of its sensors are states."""

import math
from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np

from groundstation.arrays import Array, Matrix
from groundstation.estimation.filter_state import Belief, Deferred
from groundstation.estimation.layout import ROBOT_CORE, EntityKind
from groundstation.estimation.linear import wrap
from groundstation.estimation.model_kernels import MotionKernels
from groundstation.estimation.models.driven import hold_velocity, take_heading, world_velocity
from groundstation.estimation.models.height import EVEN_M, HeightEntries, correct_height
from groundstation.estimation.models.protocol import Vector3, place_of
from groundstation.estimation.models.robot_errors import RobotParameters, add_robot_noise, fade_errors
from groundstation.estimation.motion import Dependence, add_column, depend, depend_on_two, mirror
from groundstation.estimation.records import YAW, CondensedOdometry, EntityMemory, X, Y, Z, own_parameters
from groundstation.estimation.register_blocks import add_to_row
from groundstation.kernel import kernel

AERIAL = ("roll_error", "pitch_error", "climb", "velocity_scale", "height_error", "floor")
SLOW_STATES = (*AERIAL, "velocity_bias_x", "velocity_bias_y", "yaw_offset")
# The field file's figure is the error of a vehicle that reports no doubt; its lasting part is 0.6.
_STATED_ROOM = 2.0
_DOUBT_S = 1.0  # time constant with which doubt raised by surprises decays


_OWN_STATES = ("climb", "velocity_scale", "height_error", "floor", "velocity_bias_x", "velocity_bias_y")
_own = own_parameters(RobotParameters)


@kernel(inlined=True)
def turn_with_heading(P: Matrix, start: int, size: int, dx: float, dy: float) -> None:
    """Couple the position to the yaw by which a displacement was rotated."""
    add_to_row(P, start, start + YAW, -dy)
    add_to_row(P, start + 1, start + YAW, dx)
    add_column(P, start, size, start, start + YAW, -dy)
    add_column(P, start, size, start + 1, start + YAW, dx)


@kernel()
def predict_odometry_robot(belief: Belief, e: int, dt: float) -> None:
    """Move a robot by its held odometry: velocity [base_stabilized] less bias, times gain, and its yaw rate.

    The scale state acts on the smoothed velocity: reported velocities are noisy, and a noisy regressor biases its
    factor downwards (here by 0.2 with the instantaneous one, whose quick differences are mostly noise).

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
    memory.unseen_s += step_s
    memory.velocity_doubt *= math.exp(-step_s / _DOUBT_S)
    if odometry.newest_velocity_std > p.velocity_std:
        # The vehicle's own doubt counts as long as it lasts.
        memory.velocity_doubt = max(memory.velocity_doubt, odometry.newest_velocity_std)
    if memory.active == 0 or memory.unconfirmed != 0 or odometry.height_count == 0.0:
        return
    error = start + p.at_height_error if p.at_height_error >= 0 else -1
    floor = start + p.at_floor if p.at_floor >= 0 else -1
    height = odometry.height_sum / odometry.height_count
    correct_height(belief, deferred, HeightEntries(start + Z, error, floor), height, p.height_variance, gate)


@cache
def _labels(slow_states: tuple[str, ...]) -> tuple[str, ...]:
    return (*ROBOT_CORE, *(label for label in SLOW_STATES if label in slow_states))


@dataclass(frozen=True, slots=True)
class OdometryRobot:
    """A vehicle driven by its own velocity and heading increments; slow errors of its sensors are states.

    slow_states: those of SLOW_STATES that this type of vehicle needs; without any the block is the paper's four.
    velocity_scale: true speed over reported speed as calibrated, known to `scale_std` (a state follows the rest);
    velocity_std_m_s with its correlation time becomes white noise; heading wanders by yaw_std_rad per root second;
    attitude, height and velocity errors are Gauss-Markov states; velocity_walk: change of the latter while the vehicle
    is unseen [m/s per root second]; climb is a state if the vehicle reports none. floor: height of the object below;
    yaw_offset: error of the vehicle's own heading, for the heading sensor.
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
        return _labels(self.slow_states)

    @property
    def place_m(self) -> Vector3:
        """Return the place of the marker."""
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
            # The slow part of the error is a state; the rest is quick, and correlated in neighbouring samples.
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

    def velocity_errors(self, memory: EntityMemory) -> dict[str, Vector3]:
        """Return by label the change of the velocity [ahead, left, up; along its own axes] per unit of its errors."""
        scale = self.velocity_scale
        changes: dict[str, Vector3] = {
            "climb": (0.0, 0.0, 1.0),
            "velocity_scale": (scale * float(memory["slow_vx"]), scale * float(memory["slow_vy"]), 0.0),
            "velocity_bias_x": (-scale, 0.0, 0.0),
            "velocity_bias_y": (0.0, -scale, 0.0),
        }
        return {label: change for label, change in changes.items() if label in self.labels}
