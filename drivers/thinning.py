"""Lets events of a stream through at a lower rate. Pure."""

from groundstation.time_units import NS_PER_S


class Decimator:
    """Lets events through at a nominal rate, evenly on average."""

    def __init__(self, rate_hz: float) -> None:
        self._period_ns = round(NS_PER_S / rate_hz) if rate_hz > 0 else None
        self._due_ns = 0

    def would_be_due(self, now_ns: int) -> bool:
        """Return whether an event at that time would go through."""
        # A quarter of a period early is on time: the source jitters, and half its rate must come out as half.
        return self._period_ns is not None and now_ns + self._period_ns // 4 >= self._due_ns

    def is_due(self, now_ns: int) -> bool:
        """Return whether this event goes through."""
        if self._period_ns is None or not self.would_be_due(now_ns):
            return False
        self._due_ns = max(self._due_ns + self._period_ns, now_ns)
        return True


class Grid:
    """Lets events through on the grid of a rate, so that 15 Hz become 5 Hz, not every fourth event."""

    def __init__(self, rate_hz: float) -> None:
        self._period_ns = round(NS_PER_S / rate_hz) if rate_hz > 0 else None
        self._due_ns = 0

    def is_due(self, now_ns: int) -> bool:
        """Return whether this event goes through; after a pause the grid begins anew."""
        if self._period_ns is None or now_ns < self._due_ns:
            return False
        on_grid = now_ns - self._due_ns < self._period_ns
        self._due_ns = (self._due_ns if on_grid else now_ns) + self._period_ns
        return True
