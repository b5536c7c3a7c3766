"""Due times of a fixed-rate loop, and a count of ticks that start too late."""

from dataclasses import dataclass

from groundstation.time_units import NS_PER_MS

_LATE_NS = 10 * NS_PER_MS


@dataclass(slots=True)
class Deadlines:
    """A fixed-rate loop: `next_ns` is when the coming tick is due; a tick late by more than 10 ms is an overrun."""

    period_ns: int
    next_ns: int
    ticks: int = 0
    overruns: int = 0

    def start_tick(self, now_ns: int) -> None:
        """Count a tick that starts now. Missed ticks count as overruns and are not made up for."""
        self.ticks += 1
        late_ns = now_ns - self.next_ns
        if late_ns > _LATE_NS:
            missed = late_ns // self.period_ns
            self.overruns += 1 + missed
            self.ticks += missed
            self.next_ns += missed * self.period_ns
        self.next_ns += self.period_ns
