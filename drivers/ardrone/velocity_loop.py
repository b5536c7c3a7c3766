"""Tilt, climb and turn fractions that make an AR.Drone fly a velocity. Pure.

The drone takes tilt angles, not velocities: it accelerates by g tan(tilt) and is braked by the air. Tilt answers late
(10 / 63 / 90 % after 90 / 180 / 270 ms), and so does its speed (20-40 ms), which bounds the gain.
"""

import math
from dataclasses import dataclass

from drivers.ardrone.settings import ArDroneLimits
from groundstation.bus.messages import Vector3

_GRAVITY_M_S2 = 9.81


@dataclass(frozen=True, slots=True)
class Gains:
    """proportional [1/s], integral [1/s^2], drag of the vehicle [1/s], reference_s: time constant that the integral
    part expects of the vehicle, integral_m_s2: bound of the integral part, still: speeds below this are zero [m/s,
    rad/s], settle_s: after so long at zero the drone holds its place by itself.
    """

    proportional: float = 2.4
    integral: float = 1.1
    drag: float = 0.1
    reference_s: float = 0.5
    integral_m_s2: float = 0.8
    still: float = 0.02
    settle_s: float = 1.0


@dataclass(frozen=True, slots=True)
class Attitude:
    """What to ask of the drone, FLU: pitch nose down (forward) and roll right side down [rad], climb, yaw rate ccw.

    hover: let the drone hold its place by itself; the other fields are zero then.
    """

    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    climb_m_s: float = 0.0
    yaw_rate_rad_s: float = 0.0
    hover: bool = False


HOVER = Attitude(hover=True)


class VelocityLoop:
    """PI control with drag feed-forward on both horizontal axes; climb and yaw rate are passed on within limits.

    The integral part acts on the difference to a model of the wanted response, so that a step does not wind it up.
    """

    def __init__(self, limits: ArDroneLimits, gains: Gains | None = None) -> None:
        self._limits = limits
        self._max_acceleration = _GRAVITY_M_S2 * math.tan(limits.max_tilt_rad)
        self._gains = gains or Gains()
        self.reset()

    def reset(self) -> None:
        """Forget the past; for every time the vehicle was not flown by this loop."""
        self._integral = [0.0, 0.0]
        self._reference: list[float] | None = None
        self._still_s = 0.0

    def step(self, wanted_m_s: Vector3, yaw_rate_rad_s: float, measured_m_s: Vector3, dt_s: float) -> Attitude:
        """Return the attitude for a wanted velocity, given the true (scaled) one [base_stabilized, FLU]."""
        gains = self._gains
        dt_s = min(max(dt_s, 0.0), 0.1)
        moving = max(abs(yaw_rate_rad_s), *(abs(v) for v in wanted_m_s)) > gains.still
        self._still_s = 0.0 if moving else self._still_s + dt_s
        if self._still_s >= gains.settle_s:
            self._integral, self._reference = [0.0, 0.0], None
            return HOVER
        if self._reference is None:
            self._reference = list(measured_m_s[:2])
        wanted = _shortened(wanted_m_s[0], wanted_m_s[1], self._limits.max_speed_m_s)
        x, y = (self._axis(i, wanted[i], measured_m_s[i], dt_s) for i in (0, 1))
        x, y = _shortened(x, y, self._max_acceleration)
        return Attitude(
            roll_rad=-math.atan(y / _GRAVITY_M_S2),
            pitch_rad=math.atan(x / _GRAVITY_M_S2),
            climb_m_s=_clamp(wanted_m_s[2], self._limits.max_climb_m_s),
            yaw_rate_rad_s=_clamp(yaw_rate_rad_s, self._limits.max_yaw_rate_rad_s),
        )

    def _axis(self, axis: int, wanted: float, measured: float, dt_s: float) -> float:
        gains = self._gains
        assert self._reference is not None
        self._reference[axis] += (wanted - self._reference[axis]) * min(1.0, dt_s / gains.reference_s)
        direct = gains.proportional * (wanted - measured) + gains.drag * wanted
        step = gains.integral * (self._reference[axis] - measured) * dt_s
        # Anti wind-up: no integration further into saturation.
        if abs(direct + self._integral[axis]) < self._max_acceleration or step * direct < 0.0:
            self._integral[axis] = _clamp(self._integral[axis] + step, gains.integral_m_s2)
        return direct + self._integral[axis]


def _shortened(x: float, y: float, longest: float) -> tuple[float, float]:
    # The same direction, no longer than this.
    size = math.hypot(x, y)
    return (x, y) if size <= longest else (x * longest / size, y * longest / size)


def _clamp(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
