"""The motion sensors of an AR.Drone: true state in, navdata-like readings out.

Figures of a real flight against motion capture (docs/explanation/estimation.md 9.2). Units and frames are SI and FLU;
the emulator converts them for the wire.
"""

import math
from typing import Protocol

import numpy as np

from sim_bridge.scenario import DroneScenario
from sim_bridge.world.airframe import GRAVITY_M_S2, STANDING_HEIGHT_M, Airframe
from sim_bridge.world.inertia import Inertia
from sim_bridge.world.noise import DelayLine, GaussMarkov, standard_normals
from sim_bridge.world.recorded_errors import (
    HEIGHT_CORRELATION_S,
    HEIGHT_TICKS,
    HEIGHT_WHITE_M,
    VELOCITY_CORRELATION_S,
    YAW_DRIFT_RAD_S,
)

LIFT_OFF_SEEN_M = 0.25  # the ultrasound reads nothing below
_MAGNETOMETER_SEEN_M = 0.22  # switched in a moment before
GROUND_ECHO_M = 0.243  # its reading on the floor
# Echoes of a neighbour's ultrasound: their share, and the largest difference from the height of an accepted one.
_FOREIGN_ECHOES, _BELIEVED_M = 0.25, 0.15


class Senses(Protocol):
    """Inputs of the onboard sensors."""

    airframe: Airframe
    battery: float


class Onboard:
    """Readings of one drone after each `step`; never the true values.

    vx, vy [m/s; base_stabilized, FLU], vz; height [m], 0 on the floor; roll, pitch [rad; FLU];
    yaw [rad, counter-clockwise, from power-on, jumps once at lift-off if there is a magnetometer]; gyros [rad/s],
    accelerometers [m/s^2; base]; echo [m], of the ultrasound alone; rejected, number of refused echoes in a row;
    battery 0..1. Until `trim` the attitude has the factory's error.
    """

    def __init__(
        self,
        scenario: DroneScenario,
        tick_s: float,
        start: Airframe,
        rng: np.random.Generator,
        magnetometer: bool = True,
    ) -> None:
        draw = self._draw = standard_normals(rng)
        self.velocity_gain = float(rng.uniform(*scenario.velocity_gain))
        self.velocity_delay_s = float(rng.uniform(*scenario.velocity_delay_ms)) / 1000
        jump = math.radians(float(rng.uniform(*scenario.yaw_jump_at_lift_off_deg)))
        self.yaw_jump_rad = jump if rng.random() < 0.5 else -jump
        # A generator of its own: draws for one thing do not change the others.
        (aside,) = rng.spawn(1)
        bias = math.radians(scenario.attitude_bias_deg)
        self._level = (float(aside.normal(0.0, bias)), float(aside.normal(0.0, bias)))
        self._chance = aside.random
        self._magnetometer = magnetometer
        self.echo, self.rejected = GROUND_ECHO_M, 0
        self.vx = self.vy = self.vz = self.height = self.roll = self.pitch = self.yaw = 0.0
        self.gyros = self.accelerometers = (0.0, 0.0, 0.0)
        self.battery = 1.0
        self.flow_bias, self.below_m = (0.0, 0.0), 0.0
        self._tick_s, self._ticks = tick_s, 0
        self._yaw_offset = -start.yaw
        self._lifted = self._jumped = False
        # Half of the variance is slow: noise that is white at 200 Hz would average out within a camera frame.
        self._white = scenario.velocity_noise_m_s * math.sqrt(0.5)
        self._slow = tuple(GaussMarkov(self._white, VELOCITY_CORRELATION_S, tick_s, draw) for _ in range(2))
        self._velocity: DelayLine[tuple[float, float]] = DelayLine(self.velocity_delay_s, tick_s, (0.0, 0.0))
        self._vertical: DelayLine[tuple[float, float]] = DelayLine(
            scenario.height_delay_ms / 1000, tick_s, (start.z, 0.0)
        )
        slow_height = math.sqrt(max(0.0, scenario.height_noise_m**2 - HEIGHT_WHITE_M**2))
        self._height_error = GaussMarkov(slow_height, HEIGHT_CORRELATION_S, HEIGHT_TICKS * tick_s, draw)
        tilt = math.radians(scenario.attitude_noise_deg)
        self._tilt_error = tuple(GaussMarkov(tilt, scenario.attitude_correlation_s, tick_s, draw) for _ in range(2))
        wander = math.radians(scenario.yaw_wander_deg)
        self._inertia = Inertia(draw)
        self._wander = GaussMarkov(wander, scenario.yaw_wander_correlation_s, tick_s, draw)
        self._yaw_offset -= self._wander.value

    def trim(self, roll: float = 0.0, pitch: float = 0.0) -> None:
        """Take the present attitude as level; roll, pitch: the true ones, which are wrong from now on [rad]."""
        self._level = (-roll, -pitch)

    def step(
        self, drone: Senses, motors_on: bool, crosstalk: bool = False, air: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Measure the true state once; call it once per tick.

        crosstalk: another drone's ultrasound of the same rate is in reach. air: push of moving air [m/s^2; world];
        the tilt that balances it is taken for level, as in a recorded flight, where navdata said 0 at 5 to 10 degrees.
        """
        body = drone.airframe
        draw = self._draw
        forward, left = self._velocity.push(body.velocity_stabilized())
        if motors_on:
            gain, white = self.velocity_gain, self._white
            self.vx = gain * forward + self._slow[0].step() + white * draw()
            self.vy = gain * left + self._slow[1].step() + white * draw()
            if self.flow_bias != (0.0, 0.0):
                c, s = math.cos(body.yaw), math.sin(body.yaw)
                self.vx += c * self.flow_bias[0] + s * self.flow_bias[1]
                self.vy += c * self.flow_bias[1] - s * self.flow_bias[0]
        else:
            self.vx = self.vy = 0.0
        self._measure_height(body, crosstalk)
        self.roll = body.roll + self._level[0] + self._tilt_error[0].step()
        self.pitch = body.pitch + self._level[1] + self._tilt_error[1].step()
        if air != (0.0, 0.0) and not body.on_ground:
            c, s = math.cos(body.yaw), math.sin(body.yaw)
            self.pitch += math.atan((c * air[0] + s * air[1]) / GRAVITY_M_S2)
            self.roll -= math.atan((c * air[1] - s * air[0]) / GRAVITY_M_S2)
        self._measure_yaw(body)
        self.gyros, self.accelerometers = self._inertia.measure(body, motors_on)
        self.battery = drone.battery
        self._ticks += 1

    def _measure_height(self, body: Airframe, crosstalk: bool) -> None:
        height, climb = self._vertical.push((body.z - self.below_m, body.vz))
        self._lifted = self._lifted or height > _MAGNETOMETER_SEEN_M
        if self._ticks % HEIGHT_TICKS:
            return
        error = self._height_error.step() + HEIGHT_WHITE_M * self._draw()
        if height <= STANDING_HEIGHT_M + 1e-6:
            self.height = self.vz = 0.0
            self.echo, self.rejected = GROUND_ECHO_M, 0
            return
        self.vz = climb + 0.05 * self._draw()
        seen = height > LIFT_OFF_SEEN_M
        self.echo = max(0.0, height + error) if seen else GROUND_ECHO_M
        believed = self.echo if seen else 0.0
        if crosstalk and self._chance() < _FOREIGN_ECHOES:
            self.echo = GROUND_ECHO_M + (2.0 * height) * self._chance()
            if abs(self.echo - believed) > _BELIEVED_M and self.height > 0.0:
                self.rejected += 1
                self.height += self.vz * self._tick_s * HEIGHT_TICKS
                return
            believed = self.echo
        self.rejected = 0
        self.height = believed

    def _measure_yaw(self, body: Airframe) -> None:
        if self._lifted and not self._jumped:
            self._jumped = True
            self._yaw_offset += self.yaw_jump_rad if self._magnetometer else 0.0
        self._yaw_offset += YAW_DRIFT_RAD_S * self._tick_s
        self.yaw = math.remainder(body.yaw + self._yaw_offset + self._wander.step(), math.tau)
