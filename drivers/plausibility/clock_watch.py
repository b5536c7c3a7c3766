"""Compares a sender's own clock with ours: it may stand, or run late. Pure."""

from groundstation.time_units import NS_PER_MS, NS_PER_S

# A clock that went back by less means an older packet. By more: the clock was set, or the sender was restarted; no link
# delays packets for so long.
_LONGEST_NS = 3 * NS_PER_S
# Values that are late since their clock went back may come of a clock that was set; after this time they are believed.
_SET_NS = 120 * NS_PER_S
# A value fresher than all before by more than this counts once so many in a row are: one may have a wrong stamp.
_FRESHER_NS, _CONFIRMED = 50 * NS_PER_MS, 3
# A clock that a time service corrects is slowed by this at most.
_SLOWED = 500e-6


class ClockWatch:
    """Compares the times at which values were made and received; the freshest ones define the usual delay.

    wrap_s: time at which the clock starts over; slower: by which share of the time it may run slower than ours; may be
    set anew at any time. What is late stays late for (lateness / slower), longer if its clock is slow.
    """

    def __init__(self, wrap_s: float | None = None, slower: float = _SLOWED) -> None:
        self._wrap_ns = None if wrap_s is None else round(wrap_s * 1e9)
        self.slower = slower
        self.reset()

    def reset(self) -> None:
        """Forget everything: for a sender that was restarted."""
        self._last_ns: int | None = None
        self._moved_ns = 0
        self._turns_ns = 0
        self._least_ns: int | None = None
        self._least_at_ns = 0
        self._back_since_ns: int | None = None
        self._fresher: list[int] = []

    def update(self, stamp_ns: int, sender_ns: int) -> tuple[float, float]:
        """Take receipt of a value and its time on the sender's clock.

        Return how long that time has stood, and how late the value is [s].
        """
        before, back_ns = self._last_ns, 0
        sender_ns += self._turns_ns
        if before is not None and sender_ns < before:
            sender_ns = self._wrapped(before, sender_ns)
            if sender_ns < before - _LONGEST_NS:
                self.reset()
                before = None
            else:
                back_ns = before - sender_ns
        if before is None or sender_ns != before:
            self._last_ns, self._moved_ns = sender_ns, stamp_ns
        late_ns = self._late_ns(stamp_ns, stamp_ns - sender_ns)
        return (stamp_ns - self._moved_ns) * 1e-9, self._unless_set(stamp_ns, late_ns, back_ns) * 1e-9

    def _wrapped(self, before: int, sender_ns: int) -> int:
        # A step back by more than half the clock's range is a wrap forwards.
        if self._wrap_ns is None or before - sender_ns < self._wrap_ns // 2:
            return sender_ns
        self._turns_ns += self._wrap_ns
        return sender_ns + self._wrap_ns

    def _unless_set(self, stamp_ns: int, late_ns: int, back_ns: int) -> int:
        """Return the lateness of a value, 0 where the clock was set back long ago; back_ns: its step back, now."""
        if late_ns < _FRESHER_NS:
            self._back_since_ns = None
        elif 2 * back_ns > late_ns:
            self._back_since_ns = stamp_ns
        if self._back_since_ns is None or stamp_ns - self._back_since_ns < _SET_NS:
            return late_ns
        self._least_ns = self._back_since_ns = None
        return 0

    def _late_ns(self, stamp_ns: int, offset_ns: int) -> int:
        if self._least_ns is None:
            self._least_ns, self._fresher = offset_ns, []
        else:
            self._least_ns += round(self.slower * (stamp_ns - self._least_at_ns))
        self._least_at_ns = stamp_ns
        if offset_ns >= self._least_ns - _FRESHER_NS:
            self._least_ns, self._fresher = min(self._least_ns, offset_ns), []
        else:
            self._fresher.append(offset_ns)
            if len(self._fresher) == _CONFIRMED:
                self._least_ns, self._fresher = max(self._fresher), []
        return max(0, offset_ns - self._least_ns)
