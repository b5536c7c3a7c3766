"""Removes the network's jitter from arrivals by the times that a stream carries. Pure.

The sender's clock has an unknown offset to ours. Arrival minus sent is that offset plus the delay of each frame; the
median over the last ten seconds or so is offset plus usual delay, and neither jitter nor a few late frames move it.
"""

from collections import deque
from collections.abc import Sequence
from statistics import median

from groundstation.time_units import NS_PER_S

_FRAMES = 151
# The sender was restarted, or its clock is of no use.
_JUMP_NS = 5 * NS_PER_S
# No picture comes this much earlier than usual: the sender's clock was put forward.
_EARLY_NS = NS_PER_S


class SenderClock:
    """Learns the usual delay of one stream."""

    def __init__(self) -> None:
        self._offsets: deque[int] = deque(maxlen=_FRAMES)
        self._usual_ns = 0
        self._last_sent_ns: int | None = None

    def settle(self, sent_ns: Sequence[int], arrival_ns: int) -> list[int]:
        """Return when frames that arrived together would have arrived with the usual delay, by their sender's stamps.

        Only the newest of them shows the link's delay: the others had to wait for it. While the sender's clock stands
        still or has just jumped, the result is the arrival.
        """
        newest = sent_ns[-1]
        offset = arrival_ns - newest
        stands = self._last_sent_ns is not None and newest <= self._last_sent_ns
        late_ns = offset - self._usual_ns
        if stands or (self._offsets and not -_EARLY_NS <= late_ns <= _JUMP_NS):
            self._offsets.clear()
        self._last_sent_ns = newest
        self._offsets.append(offset)
        self._usual_ns = round(median(self._offsets))
        return [sent + self._usual_ns for sent in sent_ns]
