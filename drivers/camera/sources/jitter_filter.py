"""Removes the network's jitter from arrivals by the times that a stream carries. Pure.

The sender's clock has an unknown offset to ours. Arrival minus sent is that offset plus the delay of each frame; the
median over the last ten seconds or so is offset plus usual delay, and neither jitter nor a few late frames move it.

Some senders have no clock: they number their frames as if they sent them at a certain rate, and send them at another.
Their offset never rests, and the result is the arrival.
"""

from collections import deque
from collections.abc import Sequence
from statistics import median, quantiles

from groundstation.time_units import NS_PER_MS, NS_PER_S

_FRAMES = 151
# The sender was restarted, or its clock is of no use.
_JUMP_NS = 5 * NS_PER_S
# No picture comes this much earlier than usual: the sender's clock was put forward.
_EARLY_NS = NS_PER_S
# A frame that follows within this part of the time between their stamps shows that its predecessor had waited.
_AT_ONCE = 0.25
# Offsets that wander by more between the halves of the window, and by more than jitter explains, do not rest.
_REST_NS = 8 * NS_PER_MS
_FEWEST_OF_HALF = 6


class SenderClock:
    """Learns the usual delay of one stream."""

    def __init__(self) -> None:
        self._offsets: deque[int] = deque(maxlen=_FRAMES)
        self._usual_ns = 0
        self._last_sent_ns: int | None = None
        self._last_arrival_ns = 0

    def settle(self, sent_ns: Sequence[int], arrival_ns: int) -> list[int]:
        """Return when frames that arrived together would have arrived with the usual delay, by their sender's stamps.

        Only the newest of them shows the link's delay: the others had to wait for it. While the sender's clock stands
        still, has just jumped, or runs faster or slower than ours, the result is the arrival.
        """
        newest = sent_ns[-1]
        offset = arrival_ns - newest
        self._forget(newest, arrival_ns)
        self._last_sent_ns, self._last_arrival_ns = newest, arrival_ns
        self._offsets.append(offset)
        self._usual_ns = round(median(self._offsets))
        if not _rests(list(self._offsets)):
            return [arrival_ns] * len(sent_ns)
        return [sent + self._usual_ns for sent in sent_ns]

    def _forget(self, newest: int, arrival_ns: int) -> None:
        """Drop the offsets that the newest frame disproves."""
        if self._last_sent_ns is None or not self._offsets:
            return
        sent_apart_ns, late_ns = newest - self._last_sent_ns, arrival_ns - newest - self._usual_ns
        if sent_apart_ns <= 0 or not -_EARLY_NS <= late_ns <= _JUMP_NS:
            self._offsets.clear()
        elif arrival_ns - self._last_arrival_ns < _AT_ONCE * sent_apart_ns:
            self._offsets.pop()


def _rests(offsets: Sequence[int]) -> bool:
    """Return whether the older half of the offsets [ns] has the median of the newer one."""
    half = len(offsets) // 2
    if half < _FEWEST_OF_HALF:
        return True
    older, newer = quantiles(offsets[:half]), quantiles(offsets[half:])
    spread = max(older[2] - older[0], newer[2] - newer[0])
    return abs(newer[1] - older[1]) <= max(_REST_NS, spread)
