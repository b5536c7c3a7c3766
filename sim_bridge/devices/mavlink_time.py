"""Maps a sender's times to an emulated autopilot's clock."""

from groundstation.time_units import NS_PER_MS, NS_PER_S

_JUMP_NS = 100 * NS_PER_MS
_STUBBORN = 5
_SHARE = 0.1


class SenderClock:
    """PX4 requests TIMESYNC answers and follows them; ArduPilot learns the least lag of arrivals (`learns`).

    Without either, every time counts as now.
    """

    def __init__(self, learns: bool) -> None:
        self.learns = learns
        self._offset_ns: float | None = None
        self._odd = 0

    def synchronise(self, now_ns: int, remote_ns: int, asked_ns: int) -> None:
        """Take an answer: the sender's time between our asking and now."""
        if self.learns or not 0 <= now_ns - asked_ns < NS_PER_S:
            return
        offset = (asked_ns + now_ns) / 2 - remote_ns
        if self._offset_ns is None:
            self._offset_ns = offset
        elif abs(offset - self._offset_ns) > _JUMP_NS:
            # A jump of the sender's clock is accepted only after several answers in a row.
            self._odd += 1
            if self._odd >= _STUBBORN:
                self._offset_ns, self._odd = offset, 0
        else:
            self._odd = 0
            self._offset_ns += _SHARE * (offset - self._offset_ns)

    def local_ns(self, remote_ns: int, now_ns: int) -> int:
        """Return a time of the sender on our clock."""
        if self.learns:
            lag = now_ns - remote_ns
            self._offset_ns = lag if self._offset_ns is None else min(self._offset_ns + 1000.0, lag)
        return now_ns if self._offset_ns is None else round(remote_ns + self._offset_ns)
