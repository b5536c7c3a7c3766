"""A short model of an AR.Drone's driver, not its code: velocity in, tilt out; hover without setpoints."""

import math

from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.ardrone_autopilot import MotionReferences
from sim_bridge.world.ardrone_sensors import Onboard

_GRAVITY = 9.81
_GAIN, _DRAG = 2.4, 0.45  # 1/s
_MAX_TILT = math.radians(12.0)
_STILL, _SETTLE_S = 0.02, 1.0


class Pilot:
    """Flies one drone by setpoints that expire; `scale` is the calibrated true over reported velocity."""

    def __init__(self, drone: Quadrotor, onboard: Onboard, scale: float, lifetime_s: float) -> None:
        self._drone, self._onboard = drone, onboard
        self._scale, self._lifetime_s = scale, lifetime_s
        self._wanted = (0.0, 0.0, 0.0, 0.0)
        self._until_s = -math.inf
        self._still_since_s = 0.0

    def obey(self, velocity: tuple[float, float, float], yaw_rate: float, now_s: float) -> None:
        """Take a setpoint [base_stabilized]."""
        self._wanted, self._until_s = (*velocity, yaw_rate), now_s + self._lifetime_s

    def step(self, now_s: float) -> None:
        """Command the autopilot; call it at some 30 Hz."""
        vx, vy, vz, rate = self._wanted
        if now_s > self._until_s:
            self._drone.autopilot.hover()
            return
        if max(abs(vx), abs(vy), abs(vz), abs(rate)) > _STILL:
            self._still_since_s = now_s
        if now_s - self._still_since_s > _SETTLE_S:
            self._drone.autopilot.hover()
            return
        ax = _GAIN * (vx - self._scale * self._onboard.vx) + _DRAG * vx
        ay = _GAIN * (vy - self._scale * self._onboard.vy) + _DRAG * vy
        pitch = max(-_MAX_TILT, min(_MAX_TILT, math.atan(ax / _GRAVITY)))
        roll = max(-_MAX_TILT, min(_MAX_TILT, -math.atan(ay / _GRAVITY)))
        self._drone.autopilot.move(MotionReferences(roll, pitch, vz, rate))
