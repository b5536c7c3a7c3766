"""Lets every stop of a second ground station pass, but limits repetitions. Pure: times are passed in."""

from collections.abc import Hashable

from drivers.mavlink.wire.frames import Message
from groundstation.time_units import NS_PER_MS

# As many per second as all other frames together: a serial link of 57600 baud carries 120 such frames.
_EVERY_NS = 20 * NS_PER_MS


Stop = bytes | Message


class StopQueue:
    """A stop goes at once; one within 20 ms of another waits, and replaces an equal one.

    So only repeated stops are lost, the last order arrives last, and the longest wait is 20 ms for each kind of stop.
    """

    def __init__(self) -> None:
        self._waiting: dict[Hashable, Stop] = {}
        self._next_ns = 0

    def put(self, kind: Hashable, stop: Stop) -> None:
        """Take a stop; kind: the same for equal ones."""
        self._waiting.pop(kind, None)
        self._waiting[kind] = stop

    def take(self, now_ns: int) -> Stop | None:
        """Return the stop to send now, or None."""
        if not self._waiting or now_ns < self._next_ns:
            return None
        self._next_ns = now_ns + _EVERY_NS
        return self._waiting.pop(next(iter(self._waiting)))

    def wait_ns(self, now_ns: int) -> int | None:
        """Return the time until the next one is due [ns], None while none waits."""
        return max(0, self._next_ns - now_ns) if self._waiting else None
