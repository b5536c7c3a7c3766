"""Extrapolates a vehicle's attitude between reports: an autopilot sends attitudes, velocities and rates one by one."""

import math
from dataclasses import replace

from drivers.mavlink.convert import BaseAttitude
from groundstation.geometry.angles import wrap

# Beyond this age a turn rate means nothing [s].
_LASTS_S = 0.1
_STEEPEST = 0.2


def heading_rate_rad_s(attitude: BaseAttitude) -> float:
    """Return the rate of the heading about the vertical, not about the tilted body axis [rad/s]."""
    _, q, r = attitude.rates_rad_s
    sine, cosine = math.sin(attitude.roll_rad), math.cos(attitude.roll_rad)
    return (q * sine + r * cosine) / max(_STEEPEST, math.cos(attitude.pitch_rad))


def lasting_s(elapsed_ns: int) -> float:
    """Return the part of a time for which a turn rate holds [s]."""
    return min(max(elapsed_ns * 1e-9, 0.0), _LASTS_S)


def turned_on(attitude: BaseAttitude, elapsed_ns: int) -> BaseAttitude:
    """Return an attitude turned on by its own body rates."""
    p, q, r = attitude.rates_rad_s
    elapsed_s, heading_rate = lasting_s(elapsed_ns), heading_rate_rad_s(attitude)
    rolling = p + heading_rate * math.sin(attitude.pitch_rad)
    pitching = q * math.cos(attitude.roll_rad) - r * math.sin(attitude.roll_rad)
    return replace(
        attitude,
        roll_rad=attitude.roll_rad + elapsed_s * rolling,
        pitch_rad=attitude.pitch_rad + elapsed_s * pitching,
        yaw_rad=wrap(attitude.yaw_rad + elapsed_s * heading_rate),
    )
