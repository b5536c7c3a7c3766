"""Recognises pictures that a stalled link held back, where no stamps of the sender tell. Pure.

After a gap in the arrivals the first picture is old, or the camera took none before. The next ones tell: pictures that
were held back come faster than the camera takes them, until they have made up for the gap
(docs/decisions/0344-held-back-pictures-are-withheld.md).
"""

from collections import deque
from statistics import median

from groundstation.time_units import NS_PER_MS, NS_PER_S

# The cadence is the median of the means of so many intervals: bursts of two or three do not move it.
_INTERVALS, _FEWEST, _SPAN = 31, 8, 6
# A gap is later than jitter, than one picture that is missing, and than all intervals but one of an uneven stream.
_LATE_NS, _MISSING, _UNEVEN = 100 * NS_PER_MS, 1.2, 1.5
# Within this part of the cadence after the one before, a picture had waited; so many in a row later: none waits.
_SOON, _STEADY = 0.7, 2
# By so much of the cadence a picture may still be late once the others have made up for the gap.
_MADE_UP = 0.5
# A gap after a gap, and not by this factor longer: the camera has become slow.
_SLOWED = 1.5
# The connection ends after 2 s of silence.
_MOST_BEHIND_NS = 2 * NS_PER_S
# A link that carries twice what the camera sends has caught up as long after a gap as that lasted. Whatever comes later
# is the stream's own way, and is learnt, as are gaps that follow each other within a few pictures.
_CATCHES_UP_NS = NS_PER_S // 2


class Cadence:
    """Learns how often the pictures of one connection come, and withholds those that may be old.

    None longer than half a second more than the gap before them lasted.
    """

    def __init__(self) -> None:
        self._intervals: deque[int] = deque(maxlen=_INTERVALS)
        self._last_ns: int | None = None
        self._gap: _Gap | None = None
        self._since_gap = _FEWEST

    def holds_back(self, arrival_ns: int) -> bool:
        """Take in a picture's arrival; return whether the picture may be old."""
        last_ns, self._last_ns = self._last_ns, arrival_ns
        if last_ns is None:
            return False
        apart_ns = arrival_ns - last_ns
        if len(self._intervals) < _FEWEST:
            self._intervals.append(apart_ns)
            return False
        usual_ns = self._usual_ns()
        is_long = apart_ns > self._longest_ns(usual_ns)
        if self._gap is None:
            self._since_gap += 1
            if not is_long:
                self._intervals.append(apart_ns)
                return False
            self._gap = _Gap(last_ns, apart_ns)
        gap = self._gap
        old = gap.holds_back(arrival_ns, apart_ns, usual_ns, is_long)
        self._intervals.extend(gap.learnt_ns())
        too_long = old and arrival_ns > gap.until_ns
        if too_long or (gap.over and self._since_gap < _FEWEST):
            self._intervals.extend(gap.seen_ns)
        if too_long or gap.over:
            self._gap, self._since_gap = None, 0
        return old and not too_long

    def _usual_ns(self) -> float:
        known = list(self._intervals)
        return median(sum(known[at : at + _SPAN]) for at in range(len(known) - _SPAN + 1)) / _SPAN

    def _longest_ns(self, usual_ns: float) -> float:
        uneven_ns = sorted(self._intervals)[-1 - len(self._intervals) // 16]
        return max(usual_ns + max(_LATE_NS, _MISSING * usual_ns), _UNEVEN * uneven_ns)


class _Gap:
    """A gap and the pictures after it; since_ns: the arrival before it.

    `over`: nothing is held back any more; `until_ns`: nor after this time; `seen_ns`: all intervals, the gap's too.
    """

    def __init__(self, since_ns: int, apart_ns: int) -> None:
        self.since_ns, self.until_ns = since_ns, since_ns + 2 * apart_ns + _CATCHES_UP_NS
        self.over, self.seen_ns = False, list[int]()
        self._first_ns = apart_ns
        self._learnt_ns: list[int] = []
        self._behind_ns = 0.0
        self._pictures = self._steady = self._before_ns = 0

    def holds_back(self, arrival_ns: int, apart_ns: int, usual_ns: float, is_long: bool) -> bool:
        """Take in a picture; is_long: it came after a gap itself. Return whether it may be old."""
        self.seen_ns.append(apart_ns)
        before_ns, self._before_ns = self._before_ns, apart_ns if is_long else 0
        self._pictures += 1
        self._behind_ns = min(self._behind_ns + apart_ns - usual_ns, _MOST_BEHIND_NS)
        if is_long and apart_ns > _SLOWED * before_ns:
            self._steady = 0
            return True
        if not is_long and self._behind_ns <= _MADE_UP * usual_ns:
            self._learnt_ns, self.over = [(arrival_ns - self.since_ns) // self._pictures], True
            return False
        if apart_ns < _SOON * usual_ns:
            self._steady = 0
            return True
        self._steady += 1
        self._learnt_ns.append(apart_ns)
        if self._steady == _STEADY:
            self._learnt_ns.append(self._first_ns)
            self.over = True
        return False

    def learnt_ns(self) -> list[int]:
        """Return the intervals that belong to the camera's cadence, once each."""
        learnt, self._learnt_ns = self._learnt_ns, []
        return learnt
