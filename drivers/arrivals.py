"""The rate of a link's numbered packets, and the share that arrives. Pure."""

from collections import deque

from groundstation.time_units import NS_PER_S


class Arrivals:
    """The packets of the last second, each with the step of its number from the one before."""

    def __init__(self) -> None:
        self._window: deque[tuple[int, int]] = deque()
        self._sent = 0

    def add(self, now_ns: int, step: int) -> None:
        """Take a packet."""
        self._window.append((now_ns, step))
        self._sent += step
        self._trim(now_ns)

    def rates(self, now_ns: int) -> tuple[float, float | None]:
        """Return (packets per second, share of all that were sent, or None when nothing arrived)."""
        self._trim(now_ns)
        arrived, sent = len(self._window), self._sent
        return float(arrived), min(1.0, arrived / sent) if sent else None

    def _trim(self, now_ns: int) -> None:
        while self._window and self._window[0][0] < now_ns - NS_PER_S:
            self._sent -= self._window.popleft()[1]
