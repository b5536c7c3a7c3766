"""The share of a vehicle's frames that arrive, by their sequence numbers."""

import threading

from drivers.arrivals import Arrivals

# A loss of half a turn of the counter looks like a restart; datagrams are not reordered by more than this.
_HALF_TURN, _OVERTAKEN = 128, 32


class Traffic:
    """Frames of the last second; counted by the reader, read by the sender loop."""

    def __init__(self) -> None:
        self._newest: dict[int, int] = {}
        self._arrivals = Arrivals()
        self._lock = threading.Lock()

    def count(self, now_ns: int, component: int, sequence: int) -> None:
        """Take the number of a frame; each component of a vehicle counts separately, modulo 256."""
        newest = self._newest.get(component)
        step = 1 if newest is None else (sequence - newest) % 256
        if step >= _HALF_TURN:
            # A reordered frame, counted as missing before, or a restarted sender.
            step = 0 if 256 - step <= _OVERTAKEN else 1
        if step:
            self._newest[component] = sequence
        with self._lock:
            self._arrivals.add(now_ns, step)

    def rates(self, now_ns: int) -> tuple[float, float | None]:
        """Return (frames per second, share that arrived, or None if none did)."""
        with self._lock:
            return self._arrivals.rates(now_ns)
