"""State estimate of a modern autopilot: inertial sensors, aided by poses from outside.

Without them it has no position; when they stop, it integrates its accelerometers and drifts. The frame is
that of the poses. Gains stand for those of the firmwares' filters: 1-3 cm of error for 1 cm of noise
(docs/reference/mavlink.md 1.1).
"""

import math

import numpy as np

from groundstation.vectors import Vector3
from sim_bridge.mavlink_scenario import CopterScenario
from sim_bridge.world.airframe import GRAVITY_M_S2, Airframe
from sim_bridge.world.noise import GaussMarkov, standard_normals

_BANDWIDTH, _DAMPING = 1.6, 1.0  # of the position loop [rad/s]
_BIAS_GAIN = 0.15
_YAW_GAIN = 1.0  # 1/s
_BAROMETER_GAIN = 0.5  # 1/s
_TILT_CORRELATION_S = 10.0
_GATE_M, _GATE_RAD = 0.6, 0.5
_TRUSTED_AFTER = 10  # poses
_GYRO_NOISE_RAD_S, _ACCELEROMETER_NOISE_M_S2 = 0.006, 0.08


class InertialEstimate:
    """Readings after each `step`: position, velocity [fed frame], yaw, roll, pitch [rad; FLU], gyros and
    accelerometers [base]. aided_s: since the last pose that was used; fed_s: since the last pose, used or not;
    poses: number used; rejected: number not used;
    test_ratio: distance of the last pose from the estimate, as a share of the gate; beyond 1 it is refused.
    """

    def __init__(
        self, scenario: CopterScenario, tick_s: float, rng: np.random.Generator, lift_off: float = 1.0
    ) -> None:
        draw = self._draw = standard_normals(rng)
        tilt = math.radians(scenario.attitude_noise_deg)
        self.position: Vector3 = (0.0, 0.0, 0.0)
        self.velocity: Vector3 = (0.0, 0.0, 0.0)
        self.yaw = float(rng.uniform(-math.pi, math.pi))
        self.yaw_rate = self.roll = self.pitch = 0.0
        self.gyros: Vector3 = (0.0, 0.0, 0.0)
        self.accelerometers: Vector3 = (0.0, 0.0, GRAVITY_M_S2)
        self.aided_s = self.fed_s = math.inf
        self.poses = self.rejected = 0
        self.test_ratio = 0.0
        self._tick_s = tick_s
        self._tilt = (
            GaussMarkov(tilt, _TILT_CORRELATION_S, tick_s, draw),
            GaussMarkov(tilt, _TILT_CORRELATION_S, tick_s, draw),
        )
        self._lift_off_m_s = lift_off * scenario.lift_off_velocity_m_s
        self._stood = True
        self._gyro_bias = float(rng.normal(0.0, math.radians(scenario.gyro_bias_deg_s)))
        self._up_bias = float(rng.normal(0.0, 0.05))
        self._bias = [0.0, 0.0, 0.0]
        self._resets: int | None = None
        self._last_pose_s = 0.0
        self._time_s = 0.0

    @property
    def has_position(self) -> bool:
        """Return whether enough poses came to have a position."""
        return self.poses >= _TRUSTED_AFTER

    def step(self, body: Airframe, motors_on: bool) -> None:
        """Measure the true state once and predict the estimate; call it once per tick."""
        dt, draw = self._tick_s, self._draw
        self._time_s += dt
        self.aided_s += dt
        self.fed_s += dt
        share = 1.0 if motors_on else 0.05
        wx, wy, wz = body.body_rates()
        turn = share * _GYRO_NOISE_RAD_S
        self.gyros = (wx + turn * draw(), wy + turn * draw(), wz + turn * draw())
        fx, fy, fz = (0.0, 0.0, GRAVITY_M_S2) if body.on_ground else body.specific_force()
        shake = share * _ACCELEROMETER_NOISE_M_S2
        self.accelerometers = (fx + shake * draw(), fy + shake * draw(), fz + shake * draw())
        roll_error, pitch_error = self._tilt[0].step(), self._tilt[1].step()
        self.roll, self.pitch = body.roll + roll_error, body.pitch + pitch_error
        self.yaw_rate = body.yaw_rate + self._gyro_bias + turn * draw()
        self.yaw = math.remainder(self.yaw + self.yaw_rate * dt, math.tau)
        if not self.has_position:
            return
        # An attitude error adds a part of gravity to the horizontal axes.
        c, s = math.cos(body.yaw), math.sin(body.yaw)
        forward = c * body.ax + s * body.ay + GRAVITY_M_S2 * pitch_error + shake * draw()
        left = c * body.ay - s * body.ax - GRAVITY_M_S2 * roll_error + shake * draw()
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        accelerations = (c * forward - s * left, s * forward + c * left, body.az + self._up_bias + shake * draw())
        vx, vy, vz = _sum(self.velocity, _sum(accelerations, self._bias, 1.0), dt)
        # The barometer keeps the climb rate from drifting; nothing does so for horizontal velocities.
        self.velocity = (vx, vy, vz + _BAROMETER_GAIN * dt * (body.vz + 0.1 * draw() - vz))
        if body.on_ground:
            self.velocity = (0.0, 0.0, 0.0)  # known by the landing detector
        elif self._stood and self._lift_off_m_s:
            vx, vy, vz = self.velocity
            self.velocity = (vx + self._lift_off_m_s * draw(), vy + self._lift_off_m_s * draw(), vz)
        self._stood = body.on_ground
        self.position = _sum(self.position, self.velocity, dt)

    def aid(self, position: Vector3, yaw: float, resets: int) -> bool:
        """Take a pose (its frame becomes the estimate's); returns whether it was used.

        A pose beyond the gate is refused, unless its reset counter rose: then the estimate jumps there.
        """
        jump = self._resets is not None and resets != self._resets
        first = self.poses == 0 or self.aided_s > 5.0
        self._resets = resets
        self.fed_s = 0.0
        error = _sum(position, self.position, -1.0)
        turn = math.remainder(yaw - self.yaw, math.tau)
        self.test_ratio = 0.0 if jump or first else math.hypot(*error) / _GATE_M
        if jump or first:
            self.position, self.yaw = position, yaw
        elif self.test_ratio > 1.0 or abs(turn) > _GATE_RAD:
            self.rejected += 1
            return False
        else:
            dt = min(0.2, self._time_s - self._last_pose_s)
            self.position = _sum(self.position, error, min(1.0, 2.0 * _DAMPING * _BANDWIDTH * dt))
            self.velocity = _sum(self.velocity, error, _BANDWIDTH**2 * dt)
            self._bias = list(
                _sum((self._bias[0], self._bias[1], self._bias[2]), error, _BIAS_GAIN * _BANDWIDTH**3 * dt)
            )
            self.yaw = math.remainder(self.yaw + min(1.0, _YAW_GAIN * dt) * turn, math.tau)
        self.poses += 1
        self.aided_s, self._last_pose_s = 0.0, self._time_s
        return True


def _sum(a: Vector3, b: tuple[float, ...] | list[float], scale: float) -> Vector3:
    return a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2]
