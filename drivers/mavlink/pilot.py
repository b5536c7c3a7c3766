"""Judges whether a pilot flies a vehicle, or lands one that we want to land: their sticks take precedence. Pure.

For a landing only modes that fly by sticks, without a position, count, and only while the vehicle receives a
transmitter: in other modes there may be no pilot, and without our positions the vehicle would not hold its place.
"""

from drivers.mavlink.wire.names import Flavour, flies_by_sticks, is_moved_by_sticks
from groundstation.time_units import NS_PER_MS

# A heartbeat may still name the mode that a landing has just ended.
_CERTAIN_NS = 1_500 * NS_PER_MS


class LandingPilot:
    """Detects a landing by a pilot; transmitter: the vehicle receives one, and would tell its loss."""

    def __init__(self, flavour: Flavour) -> None:
        self.transmitter = False
        self._flavour = flavour
        self._since_ns: int | None = None
        self._told = False

    def start_over(self) -> None:
        """Begin a new landing."""
        self._since_ns, self._told = None, False

    def moves(self, custom_mode: int) -> bool:
        """Return whether a pilot's sticks may be what moves it."""
        return self.transmitter and is_moved_by_sticks(self._flavour, custom_mode)

    def lands(self, now_ns: int, custom_mode: int) -> bool:
        """Return whether a pilot flies it now."""
        if not self.transmitter or not flies_by_sticks(self._flavour, custom_mode):
            self._since_ns = None
            return False
        self._since_ns = self._since_ns or now_ns
        return True

    def is_news(self, now_ns: int) -> bool:
        """Return True once in a landing, when this has lasted long enough to be reported."""
        if self._told or self._since_ns is None or now_ns - self._since_ns < _CERTAIN_NS:
            return False
        self._told = True
        return True
