"""Judges by a counter of whole seconds how late a vehicle's values are. Pure."""

from groundstation.time_units import NS_PER_S

# The counter may run slower than our clock by this share, and as much faster as it likes.
_SLOWER = 0.05
# A counter that gains more than this at once was set.
_LONGEST_NS = 3 * NS_PER_S


class TickWatch:
    """Compares the steps of a counter with our clock; the freshest ones define the usual delay.

    Its rate is followed: what grows by less than 5 % is not seen, and what stays late is so for (lateness / 5 %).
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget everything: for a counter that stood."""
        self._count: int | None = None
        self._heard_ns = self._stepped_ns = 0
        self._least_ns: int | None = None
        self._late_s = (0.0, 0.0)

    def update(self, stamp_ns: int, count: int) -> tuple[float, float]:
        """Take receipt of a value and its count [s].

        Return how late the newest step came at least, and the lesser lateness of the newest two steps [s].
        """
        gap_ns, self._heard_ns = stamp_ns - self._heard_ns, stamp_ns
        if self._count is None or count < self._count:
            self.reset()
            self._heard_ns = stamp_ns
        elif count > self._count:
            self._step(stamp_ns, stamp_ns - count * NS_PER_S, gap_ns)
        self._count = count
        return self._late_s

    def _step(self, stamp_ns: int, lag_ns: int, gap_ns: int) -> None:
        least_ns = self._least_ns
        if least_ns is None or lag_ns < least_ns - _LONGEST_NS:
            self._least_ns, self._late_s = lag_ns, (0.0, 0.0)
        else:
            self._least_ns = min(lag_ns, least_ns + round(_SLOWER * (stamp_ns - self._stepped_ns)))
            # It stepped at some time since the value before, which may have been delayed less, or the next one lost.
            late_s = max(0, lag_ns - self._least_ns - gap_ns) / NS_PER_S
            self._late_s = late_s, min(late_s, self._late_s[0])
        self._stepped_ns = stamp_ns
