"""Dates packets by the drone's own clock: a stalled link delivers in one burst what was measured over its whole stall.

WIRE (docs/reference/ardrone.md 4): packets leave every 5 ms; over WiFi 1 in 100 comes 12 ms after the one before it.
"""

from drivers.plausibility.clock_watch import ClockWatch
from groundstation.time_units import NS_PER_MS

# WIRE (docs/reference/ardrone.md 4.4): the TIME option starts over after this.
WRAP_S = 2048.0
# By this share a drone's clock may run slower than ours: far more than quartz does; it costs 3 ms in a stall of 150.
_SLOWER = 0.02
# No packet is dated earlier; plausibility refuses data that are as old.
_OLDEST_NS = 500 * NS_PER_MS
# Where all packets of so long a time are late, our clock was set, or the link's usual delay is another now.
_LATE_S, _SET_NS = 0.02, 500 * NS_PER_MS


class PacketTimes:
    """Dates the packets of one drone by its clock, with the least delay of late as the delay of all of them.

    A packet is never dated later than its arrival, nor more than 0.5 s earlier, nor before the one before it.
    """

    def __init__(self) -> None:
        self._clock = ClockWatch(WRAP_S, _SLOWER)
        self._late_since_ns: int | None = None
        self._dated_ns = 0

    def date(self, arrival_ns: int, drone_ns: int | None) -> int:
        """Return when a packet would have come without waiting; drone_ns: its time [drone], None if it has none."""
        late_ns = 0 if drone_ns is None else self._late_ns(arrival_ns, drone_ns)
        self._dated_ns = min(arrival_ns, max(self._dated_ns, arrival_ns - min(late_ns, _OLDEST_NS)))
        return self._dated_ns

    def _late_ns(self, arrival_ns: int, drone_ns: int) -> int:
        _, late_s = self._clock.update(arrival_ns, drone_ns)
        if late_s < _LATE_S:
            self._late_since_ns = None
        elif self._late_since_ns is None:
            self._late_since_ns = arrival_ns
        elif arrival_ns - self._late_since_ns >= _SET_NS:
            self._late_since_ns = None
            self._clock.reset()
            _, late_s = self._clock.update(arrival_ns, drone_ns)
        return round(late_s * 1e9)
