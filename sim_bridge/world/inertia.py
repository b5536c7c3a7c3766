"""Gyroscopes and accelerometers of a small quadrotor: true motion in, readings out.

Noise as recorded of an AR.Drone (docs/explanation/estimation.md 9.2).
"""

from groundstation.vectors import Vector3
from sim_bridge.world.airframe import GRAVITY_M_S2, Airframe
from sim_bridge.world.noise import Draw, Vibration

_ACCELEROMETER_GAIN = 0.92
# Recorded noise of the gyros [rad/s] and accelerometers [m/s^2], x y z: motors off, idling on the floor, in flight.
_STILL = ((7.5e-4, 7.5e-4, 7.5e-4), (0.031, 0.001, 0.017))
_IDLING = ((0.016, 0.016, 0.048), (0.13, 0.10, 0.07))
_FLYING = ((0.031, 0.032, 0.044), (0.045, 0.045, 0.045))
# In flight it is vibration: means over 40 ms are as accurate as with white noise, over 200 ms twice as accurate, and
# the integrated heading wanders by the white share only: 0.2 deg after 10 s.
_VIBRATION_TICKS, _WHITE_SHARE = 4, 0.28


class Inertia:
    """Measures one airframe at each tick."""

    def __init__(self, draw: Draw) -> None:
        self._draw = draw
        self._shaken = tuple(Vibration(_VIBRATION_TICKS, _WHITE_SHARE, draw) for _ in range(3))

    def measure(self, body: Airframe, motors_on: bool) -> tuple[Vector3, Vector3]:
        """Return rates [rad/s] and specific force [m/s^2; base]; call it once per tick."""
        draw = self._draw
        if motors_on and not body.on_ground:
            (rx, ry, rz), (sx, sy, sz) = _FLYING
            tx, ty, tz = [one.step() for one in self._shaken]
        else:
            (rx, ry, rz), (sx, sy, sz) = _IDLING if motors_on else _STILL
            tx, ty, tz = draw(), draw(), draw()
        wx, wy, wz = body.body_rates()
        fx, fy, fz = (0.0, 0.0, GRAVITY_M_S2) if body.on_ground else body.specific_force()
        gain = _ACCELEROMETER_GAIN
        turned = wx + rx * tx, wy + ry * ty, wz + rz * tz
        return turned, (gain * fx + sx * draw(), gain * fy + sy * draw(), gain * fz + sz * draw())
