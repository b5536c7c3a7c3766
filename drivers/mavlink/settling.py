"""Judges whether a PX4 that has just got positions has passed its own checks. Pure.

WIRE (docs/reference/mavlink.md 2): PX4's heartbeat has MAV_STATE_UNINIT until it could be armed in its present mode.
Its estimator takes some 3 s to settle on first positions. Later that state means little: without a remote control, or
in OFFBOARD without setpoints, PX4 reports it forever and arms all the same.
"""

from groundstation.time_units import NS_PER_S

_UNINIT = 0
_SETTLES_NS, _GAP_NS = 4 * NS_PER_S, NS_PER_S


class Settling:
    """Follows one vehicle from its first positions on, and again from the first after a gap."""

    def __init__(self) -> None:
        self._since_ns = self._last_ns = 0
        self._over = False

    def is_over(self, now_ns: int, status: int) -> bool:
        """Take the state in its heartbeat while it has positions; return whether it may be commanded to arm."""
        if now_ns - self._last_ns > _GAP_NS:
            self._since_ns, self._over = now_ns, False
        self._last_ns = now_ns
        self._over = self._over or status != _UNINIT or now_ns - self._since_ns >= _SETTLES_NS
        return self._over
