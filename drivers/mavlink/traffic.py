"""Share of a vehicle's frames that arrive, from their sequence numbers."""

import threading

from drivers.arrivals import Arrivals

# Half a turn of the counter is no loss that can be told from a restart; a datagram is not overtaken by more than this.
_HALF_TURN, _OVERTAKEN = 128, 32


class Traffic:
    """Frames of the last second; counted by the reader, read by the sender loop."""

    def __init__(self) -> None:
        self._newest: dict[int, int] = {}
        self._arrivals = Arrivals()
        self._lock = threading.Lock()

    def count(self, now_ns: int, component: int, sequence: int) -> None:
        """Take the number of a frame; each component of a vehicle counts for itself, modulo 256."""
        newest = self._newest.get(component)
        step = 1 if newest is None else (sequence - newest) % 256
        if step >= _HALF_TURN:
            # One that was overtaken, which has been counted as missing, or what sends was restarted.
            step = 0 if 256 - step <= _OVERTAKEN else 1
        if step:
            self._newest[component] = sequence
        with self._lock:
            self._arrivals.add(now_ns, step)

    def rates(self, now_ns: int) -> tuple[float, float | None]:
        """Return (frames per second, share that arrived, or None when nothing did)."""
        with self._lock:
            return self._arrivals.rates(now_ns)
