"""Motor commands of an AR.Drone in flight. Pure.

Mass, thrust curve and the ramp of a recorded take-off: docs/reference/ardrone.md 7.
"""

import bisect
import math

from sim_bridge.world.airframe import GRAVITY_M_S2

_MASS_KG = 0.458  # with the indoor hull
_THRUST = (1.112e-4, 7.705e-3, 0.0924)  # N per motor of the PWM in percent
# Recorded: 70 of 255 at once, 72 after 0.8 s, 80 at 1.7 s, 185 at 3.1 s.
_RAMP = ((0.0, 70.0), (0.8, 72.0), (1.7, 80.0), (3.1, 185.0))


def ramp_pwm(since_s: float) -> int:
    """Return the PWM (0..255) before lift-off; since_s: time since the motors started."""
    after = bisect.bisect_right(_RAMP, (since_s, math.inf))
    if after == len(_RAMP):
        return round(_RAMP[-1][1])
    (begin, low), (end, high) = _RAMP[after - 1], _RAMP[after]
    return round(low + (high - low) * (since_s - begin) / (end - begin))


def flight_pwm(climb_acceleration_m_s2: float, tilt_rad: float) -> int:
    """Return the PWM (0..255) for an upward acceleration at a tilt from level."""
    upright = max(0.5, math.cos(tilt_rad))
    thrust = max(0.0, _MASS_KG * (GRAVITY_M_S2 + climb_acceleration_m_s2) / upright / 4)
    a, b, c = _THRUST
    percent = (math.sqrt(max(0.0, b * b + 4 * a * (thrust - c))) - b) / (2 * a)
    return round(2.55 * max(0.0, min(100.0, percent)))
