"""Lets every stop of a second ground station pass, but not equal ones without number. Pure: times are passed in."""

from collections.abc import Hashable

from drivers.mavlink.wire.frames import Message
from groundstation.time_units import NS_PER_MS

# As many a second as of all else together: a serial link of 57600 baud carries 120 such frames.
_EVERY_NS = 20 * NS_PER_MS


Stop = bytes | Message


class StopQueue:
    """A stop goes at once; one that comes within 20 ms of another waits, and takes the place of an equal one.

    So nothing is lost but what the next one says again, the order given last arrives last, and who waits waits 20 ms
    for each kind of stop at most.
    """

    def __init__(self) -> None:
        self._waiting: dict[Hashable, Stop] = {}
        self._next_ns = 0

    def put(self, kind: Hashable, stop: Stop) -> None:
        """Take a stop; kind: what equal ones share."""
        self._waiting.pop(kind, None)
        self._waiting[kind] = stop

    def take(self, now_ns: int) -> Stop | None:
        """Return the stop that goes now, if it is time for any."""
        if not self._waiting or now_ns < self._next_ns:
            return None
        self._next_ns = now_ns + _EVERY_NS
        return self._waiting.pop(next(iter(self._waiting)))

    def wait_ns(self, now_ns: int) -> int | None:
        """Return in how long the next one goes, None while nobody waits."""
        return max(0, self._next_ns - now_ns) if self._waiting else None
