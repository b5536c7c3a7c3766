"""How much of what a vehicle sends arrives, by the sequence numbers of its frames."""

import threading
from collections import deque

_WINDOW_NS = 1_000_000_000


class Traffic:
    """Frames of the last second; counted by the reader, read by the sender loop."""

    def __init__(self) -> None:
        self._last: dict[int, int] = {}
        self._window: deque[tuple[int, int]] = deque()
        self._lock = threading.Lock()

    def count(self, now_ns: int, component: int, sequence: int) -> None:
        """Take the number of a frame; each component of a vehicle counts for itself, modulo 256."""
        before = self._last.get(component)
        self._last[component] = sequence
        step = 1 if before is None else (sequence - before) % 256 or 1
        with self._lock:
            # Half a turn of the counter is no loss that can be told from a restart.
            self._window.append((now_ns, step if step < 128 else 1))
            self._trim(now_ns)

    def rates(self, now_ns: int) -> tuple[float, float | None]:
        """Return (frames per second, share that arrived, or None when nothing did)."""
        with self._lock:
            self._trim(now_ns)
            expected = sum(step for _, step in self._window)
            return len(self._window) * 1e9 / _WINDOW_NS, len(self._window) / expected if expected else None

    def _trim(self, now_ns: int) -> None:
        while self._window and self._window[0][0] < now_ns - _WINDOW_NS:
            self._window.popleft()
