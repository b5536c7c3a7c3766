"""Notices that a vehicle's motors were stopped in flight, which not every autopilot reports as a fall. Pure.

WIRE (ArduCopter 4.6.2): disarmed by force 1.2 m above the floor it reports ON_GROUND at once, while it falls.
"""

from groundstation.time_units import NS_PER_MS

# Beyond the error of a height that cameras see as it touches down.
_ALOFT_M = 0.5
# A heartbeat reports it up to a second late; after a landing motors turn for longer before they stop.
_FELL_NS = 1_300 * NS_PER_MS

FELL = "its motors were stopped in flight, not by us: it fell"


class Motors:
    """Watches the motors of one vehicle; started: since the last look; fell: they stopped in flight and stand since."""

    def __init__(self) -> None:
        self.started = self.fell = self._turned = False
        self._aloft_ns: int | None = None

    def stop_aloft(self, now_ns: int, turn: bool, height_m: float, cut: bool) -> bool:
        """Return, once, that they have stopped although it was in the air a moment ago.

        height_m: above the floor; cut: we stop them.
        """
        stopped, self.started, self._turned = self._turned and not turn, turn and not self._turned, turn
        if height_m > _ALOFT_M:
            self._aloft_ns = now_ns
        aloft = self._aloft_ns is not None and now_ns - self._aloft_ns < _FELL_NS
        falls = stopped and aloft and not cut
        self.fell = (self.fell or falls) and not turn
        return falls
