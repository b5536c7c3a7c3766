"""The share of an autopilot's frames that arrive, by their sequence numbers.

WIRE (docs/reference/mavlink.md 5.6): another component's numbers show no losses: frames that are not for us stay on
board.
"""

import threading

from drivers.arrivals import Arrivals

# A loss of half a turn of the counter looks like a restart; datagrams are not reordered by more than this.
_HALF_TURN, _OVERTAKEN = 128, 32


class Traffic:
    """Frames of the last second; counted by the reader, read by the sender loop."""

    def __init__(self) -> None:
        self._newest: int | None = None
        self._arrivals = Arrivals()
        self._lock = threading.Lock()

    def count(self, now_ns: int, sequence: int) -> None:
        """Take the number of a frame, modulo 256."""
        step = 1 if self._newest is None else (sequence - self._newest) % 256
        if step >= _HALF_TURN:
            # A reordered frame, counted as missing before, or a restarted sender.
            step = 0 if 256 - step <= _OVERTAKEN else 1
        if step:
            self._newest = sequence
        with self._lock:
            self._arrivals.add(now_ns, step)

    def rates(self, now_ns: int) -> tuple[float, float | None]:
        """Return (frames per second, share that arrived, or None if none did)."""
        with self._lock:
            return self._arrivals.rates(now_ns)
