"""The sensors of a vehicle that flies by its own optical flow (Tello, robots of ROS 2): true state in, readings out.

These kinds have not been measured against motion capture. They have the errors of AR.Drones, by the same figures of the
scenario, except those of AR.Drones only: the jump of the heading, the ultrasound, and a velocity reported too small.
"""

import math

import numpy as np

from groundstation.vectors import Vector3
from sim_bridge.scenario import DroneScenario
from sim_bridge.world.airframe import Airframe
from sim_bridge.world.inertia import Inertia
from sim_bridge.world.noise import DelayLine, GaussMarkov, standard_normals
from sim_bridge.world.readings import Readings
from sim_bridge.world.recorded_errors import (
    HEIGHT_CORRELATION_S,
    HEIGHT_TICKS,
    HEIGHT_WHITE_M,
    VELOCITY_CORRELATION_S,
    YAW_DRIFT_RAD_S,
)

_CLIMB_WHITE_M_S = 0.05


class FlowSensors:
    """Readings of one vehicle after each `step`; never the true values, on the floor neither.

    velocity [m/s; base_stabilized, FLU], delayed; roll, pitch [rad; FLU]; yaw [rad] and position [m] in odom, which
    begins at its pad and drifts with heading and velocity; height [m] of the base above the floor, delayed.
    """

    def __init__(self, figures: DroneScenario, tick_s: float, start: Airframe, rng: np.random.Generator) -> None:
        draw = self._draw = standard_normals(rng)
        least, most = figures.velocity_gain
        self.velocity_gain = float(rng.uniform(least, most)) / (0.5 * (least + most))
        delay_s = float(rng.uniform(*figures.velocity_delay_ms)) / 1000
        self.velocity: Vector3 = (0.0, 0.0, 0.0)
        self.roll = self.pitch = self.yaw = 0.0
        self.height = start.z
        self.position = (0.0, 0.0)
        self.gyros: Vector3 = (0.0, 0.0, 0.0)
        self.accelerometers: Vector3 = (0.0, 0.0, 0.0)
        self._tick_s, self._ticks = tick_s, 0
        # Half of the variance is slow, as the AR.Drone's.
        self._white = figures.velocity_noise_m_s * math.sqrt(0.5)
        self._slow = tuple(GaussMarkov(self._white, VELOCITY_CORRELATION_S, tick_s, draw) for _ in range(2))
        self._late = DelayLine(delay_s, tick_s, (0.0, 0.0))
        self._vertical = DelayLine(figures.height_delay_ms / 1000, tick_s, (start.z, 0.0))
        slow_height = math.sqrt(max(0.0, figures.height_noise_m**2 - HEIGHT_WHITE_M**2))
        self._height_error = GaussMarkov(slow_height, HEIGHT_CORRELATION_S, HEIGHT_TICKS * tick_s, draw)
        tilt, wander = math.radians(figures.attitude_noise_deg), math.radians(figures.yaw_wander_deg)
        self._tilt_error = tuple(GaussMarkov(tilt, figures.attitude_correlation_s, tick_s, draw) for _ in range(2))
        self._wander = GaussMarkov(wander, figures.yaw_wander_correlation_s, tick_s, draw)
        self._turned = -start.yaw - self._wander.value
        self._inertia = Inertia(draw)

    def step(self, body: Airframe, motors_on: bool) -> None:
        """Measure the true state once; call it once per tick."""
        forward, left = self._late.push(body.velocity_stabilized())
        height, climb = self._vertical.push((body.z, body.vz))
        if motors_on:
            gain, white, draw = self.velocity_gain, self._white, self._draw
            ahead, aside = (slow.step() + white * draw() for slow in self._slow)
            self.velocity = (gain * forward + ahead, gain * left + aside, climb + _CLIMB_WHITE_M_S * draw())
        else:
            self.velocity = (0.0, 0.0, 0.0)
        if self._ticks % HEIGHT_TICKS == 0:
            self.height = height + self._height_error.step() + HEIGHT_WHITE_M * self._draw()
        self.roll, self.pitch = (
            true + off.step() for true, off in zip((body.roll, body.pitch), self._tilt_error, strict=True)
        )
        self._turned += YAW_DRIFT_RAD_S * self._tick_s
        self.yaw = math.remainder(body.yaw + self._turned + self._wander.step(), math.tau)
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        (ahead, aside, _), (x, y), dt = self.velocity, self.position, self._tick_s
        self.position = (x + dt * (c * ahead - s * aside), y + dt * (s * ahead + c * aside))
        self.gyros, self.accelerometers = self._inertia.measure(body, motors_on)
        self._ticks += 1

    def readings(self, ticks: int, battery: float) -> Readings:
        """Return its last measurements, at a time of its own clock."""
        return Readings(
            ticks, self.velocity, self.roll, self.pitch, self.yaw, self.gyros, self.accelerometers, battery,
            self.height, position=(*self.position, self.height),
        )  # fmt: skip
