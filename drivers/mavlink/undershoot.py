"""Learns a vehicle's shortfall from its commanded velocity, as cameras see it. Pure.

An autopilot whose tilt is wrong by a degree leans that much too little, until its own integrator has learnt it: a real
PX4 flew 0.2 m/s of 0.4 for several seconds after lift-off (docs/reference/mavlink.md 2.1). Its reported velocity is
right then, so it is no drift.
"""

import math

from drivers.mavlink.smoothing import share_of, towards
from groundstation.time_units import NS_PER_S
from groundstation.vectors import Vector2

_STILL: Vector2 = (0.0, 0.0)
# Time constant of a healthy vehicle's response.
_RESPONSE_S = 0.6
# Gain of the integral [1/s]: with that response, and a belief that is half a second late, its phase margin is 50
# degrees.
_GAIN = 0.7
_MOST_M_S = 0.25
# A command that changed by more is still being followed: vehicles differ in how fast, and that is no undershoot.
_STEADY_M_S = 0.1
_GAP_S = 0.1


class Undershoot:
    """missing: the velocity to add to commands [m/s; world] so that the vehicle flies them; 0.25 at most."""

    def __init__(self) -> None:
        self.missing, self._asked, self._expected = _STILL, _STILL, _STILL
        self._told_ns = self._heard_ns = 0

    def note_command(self, now_ns: int, asked_m_s: Vector2) -> None:
        """Note the requested velocity [world], without corrections."""
        self._expected = towards(self._expected, asked_m_s, share_of(now_ns - self._told_ns, _RESPONSE_S))
        self._asked, self._told_ns = asked_m_s, now_ns

    def take(self, now_ns: int, seen_m_s: Vector2) -> None:
        """Take the velocity that cameras see [world]."""
        step, self._heard_ns = _GAIN * min((now_ns - self._heard_ns) / NS_PER_S, _GAP_S), now_ns
        if math.dist(self._asked, self._expected) > _STEADY_M_S:
            return
        errors = zip(self.missing, self._expected, seen_m_s, strict=True)
        x, y = (missing + step * (expected - seen) for missing, expected, seen in errors)
        kept = min(1.0, _MOST_M_S / max(math.hypot(x, y), _MOST_M_S))
        self.missing = kept * x, kept * y
