"""When a planner must stop, so that it keeps its time though it asks only now and then."""

from collections.abc import Callable

_FORGET = 0.9  # of the longest time between two questions, what is left of it at the next


class TimeBudget:
    """Says stop as soon as the next question would come too late.

    A question is expected as late as the longest of the last few took: one evaluation for thirty robots takes
    milliseconds. clock: seconds, from any origin; the budget [s] begins now.
    """

    def __init__(self, budget_s: float, clock: Callable[[], float]) -> None:
        self._clock, self._last = clock, clock()
        self.deadline = self._last + budget_s
        self._longest = 0.0

    def must_stop(self) -> bool:
        """Return whether a planner that is asked now has to end."""
        now = self._clock()
        self._longest = max(now - self._last, _FORGET * self._longest)
        self._last = now
        return now + self._longest > self.deadline
