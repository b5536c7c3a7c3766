"""Compares an autopilot's heading in flight with the tracker's, which cameras correct. Pure.

The autopilot gets its heading from our poses. If its heading is off, every velocity is turned by the same angle,
whether commanded in that heading or reported by the vehicle. Corrections then turn too, and swing up within seconds.
"""

import math

from groundstation.bus.messages import EntityEstimate
from groundstation.geometry.angles import wrap
from groundstation.time_units import NS_PER_MS

# Beyond three deviations of both, and half of the angle from which a corrected velocity no longer converges.
_OFF_RAD, _OFF_NS = math.radians(25.0), 800 * NS_PER_MS
_FOUND_RAD, _FOUND_NS = math.radians(15.0), 1000 * NS_PER_MS
_SEEN_S, _KNOWN_RAD = 0.5, math.radians(5.0)


class HeadingWatch:
    """Whether the heading is off: for 0.8 s by 25 degrees; until it has been within 15 for a second."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Begin anew, for a vehicle that stands: it may not have our heading yet."""
        self.reason = ""
        self._since_ns: int | None = None

    def lose(self) -> None:
        """Note that it cannot be compared now: what was seen before is not in a row with what follows."""
        self._since_ns = None

    def take(self, now_ns: int, estimate: EntityEstimate, heading_rad: float) -> None:
        """Take the tracker's estimate of the vehicle in flight, and its heading now by its own report [rad; world]."""
        known = len(estimate.covariance) == 16 and estimate.covariance[15] <= _KNOWN_RAD**2
        if estimate.age_s > _SEEN_S or not known:
            self.lose()
            return
        off_rad = abs(wrap(heading_rad - estimate.mean[3]))
        if not (off_rad < _FOUND_RAD if self.reason else off_rad > _OFF_RAD):
            self.lose()
            return
        self._since_ns = now_ns if self._since_ns is None else self._since_ns
        if now_ns - self._since_ns >= (_FOUND_NS if self.reason else _OFF_NS):
            off = f"its heading is off by {math.degrees(off_rad):.0f} deg from the tracker's"
            self.reason, self._since_ns = "" if self.reason else off, None
