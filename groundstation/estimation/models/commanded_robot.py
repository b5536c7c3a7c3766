"""A ground robot of which only the commanded speeds are known: it follows them late and inexactly.

f: forward = (1 + forward_scale) v - turn_drag |w|, rate = (1 + turn_scale) w + turn_offset, on an arc during a step. It
answers a command `response_s` late (its odometry delay is minus that) and approaches it within `lag_s`. The errors of
its range and bearing sensor are states too.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from groundstation.arrays import Array, Matrix
from groundstation.estimation.filter_state import Belief, Deferred
from groundstation.estimation.layout import ROBOT_CORE, EntityKind
from groundstation.estimation.linear import wrap
from groundstation.estimation.model_kernels import MotionKernels
from groundstation.estimation.models.driven import SILENT_TURN_DENSITY, hold_velocity, position_density, world_velocity
from groundstation.estimation.models.protocol import Vector3
from groundstation.estimation.motion import depend, fade, mirror
from groundstation.estimation.records import YAW, CondensedOdometry, EntityMemory, X, Y, own_parameters
from groundstation.kernel import Record, kernel

FORWARD_SCALE, TURN_DRAG, TURN_SCALE, TURN_OFFSET, RANGE_BIAS, RANGE_SCALE, BEARING_BIAS = range(4, 11)
STANDS = 1e-3  # smaller commands count as zero [m/s, rad/s]
# Readings beyond the gate make the commands doubtful: for this time, and this far from the robot they move a point as
# much by turning as by driving [m].
_DOUBT_S, _DOUBT_M = 1.0, 1.0


class DriveParameters(Record):
    """Noise of driving, and deviations and correlation times of the errors that are states.

    speed_density [m^2/s] at any speed, speed_noise and slip_density [m] per metre driven, along and across;
    rate_density [rad^2/s], turn_noise [rad] per radian turned, sway_noise [rad^2/m] of the heading; hold_s: how long a
    command holds in silence; lag_s: time constant with which the robot follows; drag_mean: speed lost per rate of turn
    [m].
    """

    speed_density: float
    speed_noise: float
    slip_density: float
    rate_density: float
    turn_noise: float
    sway_noise: float
    scale_std: float
    scale_tau_s: float
    turn_scale_std: float
    offset_std: float
    offset_tau_s: float
    range_std: float
    range_scale_std: float
    range_tau_s: float
    bearing_std: float
    bearing_tau_s: float
    drag_mean: float
    drag_std: float
    hold_s: float
    lag_s: float


_own = own_parameters(DriveParameters)


@kernel()
def add_drive_noise(
    P: Matrix, start: int, p: DriveParameters, memory: EntityMemory, heading: float, forward: float, rate: float,
    dt: float,
) -> None:  # fmt: skip
    """Add the noise of driving: along the heading with the speed, across by slip, and of the heading with both.

    More of all while the commands are silent, or contradicted by readings.
    """
    astray = _DOUBT_S * memory.velocity_doubt * memory.velocity_doubt
    idle = position_density(0.0, memory.odometry_age_s, p.hold_s) + astray
    along = (p.speed_density + p.speed_noise * abs(forward) + idle) * dt
    across = (p.slip_density * abs(forward) + idle) * dt + 1e-8 * dt
    c, n = math.cos(heading), math.sin(heading)
    P[start, start] += c * c * along + n * n * across
    P[start + 1, start + 1] += n * n * along + c * c * across
    P[start, start + 1] += c * n * (along - across)
    P[start + 1, start] += c * n * (along - across)
    turning = p.rate_density + p.turn_noise * abs(rate) + p.sway_noise * abs(forward) + astray / _DOUBT_M**2
    P[start + YAW, start + YAW] += (turning + (SILENT_TURN_DENSITY if memory.odometry_age_s > p.hold_s else 0.0)) * dt


@kernel()
def predict_commanded_robot(belief: Belief, e: int, dt: float) -> None:
    """Drive an arc at the commanded speeds, scaled; scales and offsets decay to the values known for the type."""
    mean, P, entity, memory = belief.mean, belief.P, belief.entities[e], belief.memory[e]
    start, size, p = entity.start, entity.size, _own(entity)
    v, w = memory.held_vx, memory.yaw_rate
    # A robot commanded to stand does stand.
    moving = 1.0 if abs(v) > STANDS or abs(w) > STANDS else 0.0
    rate = (1.0 + mean[start + TURN_SCALE]) * w + moving * mean[start + TURN_OFFSET]
    drag = (p.drag_mean + mean[start + TURN_DRAG]) * abs(w)
    forward = (1.0 + mean[start + FORWARD_SCALE]) * v - drag
    heading = mean[start + YAW] + 0.5 * rate * dt
    c, n = math.cos(heading) * dt, math.sin(heading) * dt
    mean[start] += c * forward
    mean[start + 1] += n * forward
    mean[start + YAW] = wrap(mean[start + YAW] + rate * dt)
    depend(P, start, size, X, YAW, -n * forward)
    depend(P, start, size, Y, YAW, c * forward)
    depend(P, start, size, X, FORWARD_SCALE, c * v)
    depend(P, start, size, Y, FORWARD_SCALE, n * v)
    depend(P, start, size, X, TURN_DRAG, -c * abs(w))
    depend(P, start, size, Y, TURN_DRAG, -n * abs(w))
    depend(P, start, size, X, TURN_SCALE, -0.5 * dt * w * n * forward)
    depend(P, start, size, Y, TURN_SCALE, 0.5 * dt * w * c * forward)
    depend(P, start, size, X, TURN_OFFSET, -0.5 * dt * n * forward * moving)
    depend(P, start, size, Y, TURN_OFFSET, 0.5 * dt * c * forward * moving)
    depend(P, start, size, YAW, TURN_SCALE, dt * w)
    depend(P, start, size, YAW, TURN_OFFSET, dt * moving)
    fade(mean, P, start, size, FORWARD_SCALE, p.scale_std, dt / p.scale_tau_s)
    fade(mean, P, start, size, TURN_DRAG, p.drag_std, dt / p.scale_tau_s)
    fade(mean, P, start, size, TURN_SCALE, p.turn_scale_std, dt / p.scale_tau_s)
    fade(mean, P, start, size, TURN_OFFSET, p.offset_std, dt / p.offset_tau_s)
    fade(mean, P, start, size, RANGE_BIAS, p.range_std, dt / p.range_tau_s)
    fade(mean, P, start, size, RANGE_SCALE, p.range_scale_std, dt / p.range_tau_s)
    fade(mean, P, start, size, BEARING_BIAS, p.bearing_std, dt / p.bearing_tau_s)
    add_drive_noise(P, start, p, memory, heading, forward, rate, dt)
    mirror(P, start, size, size)


@kernel()
def begin_commanded_robot(
    belief: Belief, deferred: Deferred, odometry: CondensedOdometry, e: int, step_s: float, gate: float
) -> None:
    """Let the robot's speeds approach those commanded for this step."""
    memory, p = belief.memory[e], _own(belief.entities[e])
    forward, rate = memory.held_vx, memory.yaw_rate
    hold_velocity(odometry, memory, p.hold_s, step_s)
    memory.velocity_doubt *= math.exp(-step_s / _DOUBT_S)
    if odometry.velocity_count > 0.0:
        memory.commanded_vx, memory.commanded_rate = memory.held_vx, memory.yaw_rate
    elif memory.odometry_age_s > p.hold_s:
        memory.commanded_vx = memory.commanded_rate = 0.0
    share = 1.0 - math.exp(-step_s / p.lag_s)
    memory.held_vx = forward + share * (memory.commanded_vx - forward)
    memory.yaw_rate = rate + share * (memory.commanded_rate - rate)


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
    kernels: ClassVar[MotionKernels] = MotionKernels(predict_commanded_robot, begin_commanded_robot)
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
        """Return the delay of velocities: negative, because the robot follows a command after its stamp."""
        return -self.response_s

    @property
    def height_delay_s(self) -> float:
        """Return 0: there is no height sensor."""
        return 0.0

    @property
    def place_m(self) -> Vector3:
        """Return the place of the marker."""
        return self.marker_position_m

    def own(self) -> DriveParameters:
        """Return the parameters that the kernels read."""
        return DriveParameters.row(
            speed_density=self.speed_density,
            speed_noise=self.speed_noise_m,
            slip_density=self.slip_noise_m,
            rate_density=self.rate_density,
            turn_noise=self.turn_noise_rad,
            sway_noise=self.sway_noise,
            scale_std=self.scale_std,
            scale_tau_s=self.scale_correlation_s,
            turn_scale_std=self.turn_scale_std,
            offset_std=self.offset_std_rad_s,
            offset_tau_s=self.offset_correlation_s,
            range_std=self.range_bias_std_m,
            range_scale_std=self.range_scale_std,
            range_tau_s=self.range_bias_correlation_s,
            bearing_std=self.bearing_bias_std_rad,
            bearing_tau_s=self.bearing_bias_correlation_s,
            drag_mean=self.turn_drag_m,
            drag_std=self.turn_drag_std_m,
            hold_s=self.hold_s,
            lag_s=self.lag_s,
        )

    def prior(self) -> Array:
        """Return mean and variances (2, size) of its block when it joins."""
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

    def velocity_m_s(self, block: Array, memory: EntityMemory) -> Vector3:
        """Return the velocity [world] from the block's mean and the held command."""
        return world_velocity(block[YAW], (1.0 + block[FORWARD_SCALE]) * memory["held_vx"], 0.0, 0.0)

    def velocity_errors(self, memory: EntityMemory) -> dict[str, Vector3]:
        """Return by label the change of the velocity [ahead, left, up; along its own axes] per unit of its errors."""
        return {"forward_scale": (float(memory["held_vx"]), 0.0, 0.0)}
