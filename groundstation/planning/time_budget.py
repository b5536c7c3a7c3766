"""Decides when a planner must stop to keep its time budget although it checks only now and then."""

from collections.abc import Callable

_FORGET = 0.9  # factor by which the longest time between two checks decays at each check


class TimeBudget:
    """Stops as soon as the next check would come too late.

    The next check is expected after the longest of the recent intervals: one evaluation for thirty robots takes
    milliseconds. clock: seconds, from any origin; the budget [s] begins now.
    """

    def __init__(self, budget_s: float, clock: Callable[[], float]) -> None:
        self._clock, self._last = clock, clock()
        self.deadline = self._last + budget_s
        self._longest = 0.0

    def must_stop(self) -> bool:
        """Return whether a planner that checks now must end."""
        now = self._clock()
        self._longest = max(now - self._last, _FORGET * self._longest)
        self._last = now
        return now + self._longest > self.deadline
