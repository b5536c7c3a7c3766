"""Schedules ticks on the boot clock, and counts late ones."""

from groundstation.time_units import NS_PER_MS
from sim_bridge.world.world import TICK_NS

LATE_NS = 10 * NS_PER_MS
# After a longer pause (SIGSTOP, a suspended laptop) the world has stood still; making up for it would be a burst.
_GIVE_UP_NS = 250 * NS_PER_MS
TOLERATED_SHARE = 0.01


class Clockwork:
    """Hands out the deadline of each tick; a tick that begins > 10 ms after its deadline is an overrun.

    Only ticks that matter are judged: while nothing flies yet, kernels are compiled and processes start.
    """

    def __init__(self, now_ns: int) -> None:
        self.deadline_ns = now_ns
        self.ticks = 0
        self.judged = self.overruns = 0
        self.pictures = self.late_pictures = 0
        self._drawn = (0, 0)

    def next_deadline(self) -> int:
        """Return when the next tick is due [ns]."""
        self.deadline_ns += TICK_NS
        self.ticks += 1
        return self.deadline_ns

    def begin(self, now_ns: int, matters: bool = True) -> None:
        """Note the tick's actual begin; a schedule that is far behind starts anew."""
        late_ns = now_ns - self.deadline_ns
        self.judged += matters
        self.overruns += matters and late_ns > LATE_NS
        if late_ns > _GIVE_UP_NS:
            self.deadline_ns = now_ns

    def count_pictures(self, drawn: int, late: int, matters: bool = True) -> None:
        """Take the number of pictures so far, and of the late ones among them."""
        if matters:
            self.pictures += drawn - self._drawn[0]
            self.late_pictures += late - self._drawn[1]
        self._drawn = (drawn, late)

    @property
    def faults(self) -> list[str]:
        """Return reasons why the run is invalid: more than 1 % of the judged ticks, or of the pictures, were late."""
        found = []
        if self.overruns > max(1.0, TOLERATED_SHARE * self.judged):
            found.append("more than 1 % of the ticks late by > 10 ms: this run is invalid")
        if self.late_pictures > max(1.0, TOLERATED_SHARE * self.pictures):
            found.append("more than 1 % of the pictures drawn too late: this run is invalid")
        return found
