"""What an AR.Drone believes about its own motion: true state in, navdata-like readings out.

Figures of a real flight against motion capture (estimation.md, section 2). Units and frames are SI and FLU; the
emulator turns them into what stands on the wire.
"""

import math
from typing import Protocol

import numpy as np

from sim_bridge.scenario import DroneScenario
from sim_bridge.world.airframe import GRAVITY_M_S2, STANDING_HEIGHT_M, Airframe
from sim_bridge.world.noise import DelayLine, GaussMarkov, standard_normals

LIFT_OFF_SEEN_M = 0.2  # the ultrasound reads nothing below
_HEIGHT_TICKS = 3  # a new height about every 15 ms
_HEIGHT_CORRELATION_S = 2.0
_HEIGHT_WHITE_M = 0.005
_VELOCITY_CORRELATION_S = 0.4
_ACCELEROMETER_GAIN = 0.92
_GYRO_NOISE_RAD_S, _ACCELEROMETER_NOISE_M_S2 = 0.03, 0.045
_STILL_SHARE = 0.03  # of those noises while the motors are off
_YAW_DRIFT_RAD_S = math.radians(0.0185)


class Senses(Protocol):
    """What the onboard sensors look at."""

    airframe: Airframe
    battery: float


class Onboard:
    """Readings of one drone after each `step`; never the true values.

    vx, vy [m/s; base_stabilized, FLU], vz; height [m], 0 on the floor; roll, pitch [rad; FLU];
    yaw [rad, counter-clockwise, from power-on, jumps once at lift-off]; gyros [rad/s], accelerometers [m/s^2; base];
    battery 0..1.
    """

    def __init__(self, scenario: DroneScenario, tick_s: float, start: Airframe, rng: np.random.Generator) -> None:
        draw = self._draw = standard_normals(rng)
        self.velocity_gain = float(rng.uniform(*scenario.velocity_gain))
        self.velocity_delay_s = float(rng.uniform(*scenario.velocity_delay_ms)) / 1000
        jump = math.radians(float(rng.uniform(*scenario.yaw_jump_at_lift_off_deg)))
        self.yaw_jump_rad = jump if rng.random() < 0.5 else -jump
        self.vx = self.vy = self.vz = self.height = self.roll = self.pitch = self.yaw = 0.0
        self.gyros = self.accelerometers = (0.0, 0.0, 0.0)
        self.battery = 1.0
        self._tick_s, self._ticks = tick_s, 0
        self._yaw_offset = -start.yaw
        self._jumped = False
        # Half of the variance is slow: noise that is white at 200 Hz would average out within a camera frame.
        self._white = scenario.velocity_noise_m_s * math.sqrt(0.5)
        self._slow = tuple(GaussMarkov(self._white, _VELOCITY_CORRELATION_S, tick_s, draw) for _ in range(2))
        self._velocity: DelayLine[tuple[float, float]] = DelayLine(self.velocity_delay_s, tick_s, (0.0, 0.0))
        self._vertical: DelayLine[tuple[float, float]] = DelayLine(
            scenario.height_delay_ms / 1000, tick_s, (start.z, 0.0)
        )
        slow_height = math.sqrt(max(0.0, scenario.height_noise_m**2 - _HEIGHT_WHITE_M**2))
        self._height_error = GaussMarkov(slow_height, _HEIGHT_CORRELATION_S, _HEIGHT_TICKS * tick_s, draw)
        tilt = math.radians(scenario.attitude_noise_deg)
        self._tilt_error = tuple(GaussMarkov(tilt, scenario.attitude_correlation_s, tick_s, draw) for _ in range(2))
        wander = math.radians(scenario.yaw_wander_deg)
        self._wander = GaussMarkov(wander, scenario.yaw_wander_correlation_s, tick_s, draw)
        self._yaw_offset -= self._wander.value

    def step(self, drone: Senses, motors_on: bool) -> None:
        """Measure the true state once; call it once per tick."""
        body = drone.airframe
        draw = self._draw
        forward, left = self._velocity.push(body.velocity_stabilized())
        if motors_on:
            gain, white = self.velocity_gain, self._white
            self.vx = gain * forward + self._slow[0].step() + white * draw()
            self.vy = gain * left + self._slow[1].step() + white * draw()
        else:
            self.vx = self.vy = 0.0
        self._measure_height(body)
        self.roll = body.roll + self._tilt_error[0].step()
        self.pitch = body.pitch + self._tilt_error[1].step()
        self._measure_yaw(body)
        self._measure_inertia(body, 1.0 if motors_on else _STILL_SHARE)
        self.battery = drone.battery
        self._ticks += 1

    def _measure_height(self, body: Airframe) -> None:
        height, climb = self._vertical.push((body.z, body.vz))
        if self._ticks % _HEIGHT_TICKS:
            return
        error = self._height_error.step() + _HEIGHT_WHITE_M * self._draw()
        if height <= STANDING_HEIGHT_M + 1e-6:
            self.height = self.vz = 0.0
        else:
            self.height = max(0.0, height + error) if height > LIFT_OFF_SEEN_M else 0.0
            self.vz = climb + 0.05 * self._draw()

    def _measure_yaw(self, body: Airframe) -> None:
        if not self._jumped and body.z > LIFT_OFF_SEEN_M:
            self._jumped = True  # the magnetometer is switched in
            self._yaw_offset += self.yaw_jump_rad
        self._yaw_offset += _YAW_DRIFT_RAD_S * self._tick_s
        self.yaw = math.remainder(body.yaw + self._yaw_offset + self._wander.step(), math.tau)

    def _measure_inertia(self, body: Airframe, share: float) -> None:
        draw, turn, shake = self._draw, share * _GYRO_NOISE_RAD_S, share * _ACCELEROMETER_NOISE_M_S2
        wx, wy, wz = body.body_rates()
        self.gyros = (wx + turn * draw(), wy + turn * draw(), wz + turn * draw())
        fx, fy, fz = (0.0, 0.0, GRAVITY_M_S2) if body.on_ground else body.specific_force()
        gain = _ACCELEROMETER_GAIN
        self.accelerometers = (gain * fx + shake * draw(), gain * fy + shake * draw(), gain * fz + shake * draw())
