"""Removes the network's jitter from arrivals by the times that a stream carries. Pure.

The sender's clock has an unknown offset to ours. Arrival minus sent is that offset plus the delay of each frame; the
median over the last ten seconds or so is offset plus usual delay, and neither jitter nor a few late frames move it.

All frames come earlier than usual once a clock is put forward, or a congested link recovers. That is noticed at once:
the median alone would need half of those ten seconds.

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
# Stamps that anybody may have written are believed while half of the offsets lie within this.
_STEADY_NS = 50 * NS_PER_MS
# A stream may begin with what its sender has stored, faster than by its stamps; for how long it can be recognised.
_STORED, _OPENING_NS = 0.5, 3 * NS_PER_S
# By so much earlier than usual frames come by jitter. After a jump of the stamps alone so many running prove that the
# sender's clock was put forward; links change by as much for seconds at a time, but their stamps do not jump.
_AHEAD_NS, _AHEAD_FRAMES = 30 * NS_PER_MS, 3
# So far ahead so many prove it in any case: the usual delay was that of a congested link.
_FAR_AHEAD_NS, _FAR_AHEAD_FRAMES = 150 * NS_PER_MS, 5
_GAPS = 31


class SenderClock:
    """Learns the usual delay of one stream.

    `opening`: all frames so far may have been stored by the sender, and their times are unknown.
    """

    def __init__(self) -> None:
        self._offsets: deque[int] = deque(maxlen=_FRAMES)
        self._usual_ns = 0
        self._ahead = _Ahead()
        self._last_sent_ns: int | None = None
        self._last_arrival_ns = 0
        self._first_arrival_ns: int | None = None
        self.opening = True

    @property
    def proven(self) -> bool:
        """Return whether the stamps have risen as time does for a while."""
        offsets = list(self._offsets)
        if len(offsets) < 2 * _FEWEST_OF_HALF or not _rests(offsets):
            return False
        lower, _, upper = quantiles(offsets)
        return upper - lower <= _STEADY_NS

    def settle(self, sent_ns: Sequence[int], arrival_ns: int) -> list[int]:
        """Return when frames that arrived together would have arrived with the usual delay, by their sender's stamps.

        Only the newest of them shows the link's delay: the others had to wait for it. While the sender's clock stands
        still, has just jumped, or runs faster or slower than ours, the result is the arrival.
        """
        newest = sent_ns[-1]
        offset = arrival_ns - newest
        self._open(newest, arrival_ns)
        if self._last_sent_ns is not None and self._offsets:
            apart_ns = newest - self._last_sent_ns, arrival_ns - self._last_arrival_ns
            self._ahead.take(self._usual_ns - offset, *apart_ns, len(sent_ns))
        self._forget(newest, arrival_ns)
        self._last_sent_ns, self._last_arrival_ns = newest, arrival_ns
        self._offsets.append(offset)
        rests = _rests(list(self._offsets))
        if rests and self._ahead.proven:
            self._offsets = deque(list(self._offsets)[-self._ahead.proven :], maxlen=_FRAMES)
        self._usual_ns = round(median(self._offsets))
        if not rests:
            return [arrival_ns] * len(sent_ns)
        usual_ns = offset if self._ahead.suspected else self._usual_ns
        return [sent + usual_ns for sent in sent_ns]

    def _open(self, newest: int, arrival_ns: int) -> None:
        """Drop the offsets of frames that the sender had stored when the stream began."""
        if not self.opening:
            return
        if self._first_arrival_ns is None or self._last_sent_ns is None:
            self._first_arrival_ns = arrival_ns
        else:
            stored = arrival_ns - self._last_arrival_ns < _STORED * (newest - self._last_sent_ns)
            self.opening = stored and arrival_ns - self._first_arrival_ns < _OPENING_NS
            self._offsets.clear()

    def _forget(self, newest: int, arrival_ns: int) -> None:
        """Drop the offsets that the newest frame disproves."""
        if self._last_sent_ns is None or not self._offsets:
            return
        sent_apart_ns, late_ns = newest - self._last_sent_ns, arrival_ns - newest - self._usual_ns
        if sent_apart_ns <= 0 or not -_EARLY_NS <= late_ns <= _JUMP_NS:
            self._offsets.clear()
        elif arrival_ns - self._last_arrival_ns < _AT_ONCE * sent_apart_ns:
            self._offsets.pop()


class _Ahead:
    """Counts the newest frames in a row that came earlier than usual, with the reason."""

    def __init__(self) -> None:
        self._gaps_ns: deque[float] = deque(maxlen=_GAPS)
        self._count = self._far = 0
        self._stamps_jumped = False

    @property
    def suspected(self) -> bool:
        """Return whether the offset from before may not be believed any more."""
        return self._stamps_jumped or self._far > 0

    @property
    def proven(self) -> int:
        """Return how many of the newest frames have another offset for certain; 0: none."""
        if self._stamps_jumped and self._count >= _AHEAD_FRAMES:
            return self._count
        return self._far if self._far >= _FAR_AHEAD_FRAMES else 0

    def take(self, early_ns: int, sent_apart_ns: int, arrival_apart_ns: int, frames: int) -> None:
        """Take in by how much a frame was early, and how long after the one before it was sent and came.

        frames: how many have come since.
        """
        if early_ns <= _AHEAD_NS:
            self._count, self._stamps_jumped = 0, False
        else:
            usual_ns = frames * median(self._gaps_ns) if self._gaps_ns else arrival_apart_ns
            self._stamps_jumped |= not self._count and sent_apart_ns - max(usual_ns, arrival_apart_ns) > _AHEAD_NS
            self._count += 1
        self._far = self._far + 1 if early_ns > _FAR_AHEAD_NS else 0
        self._gaps_ns.append(sent_apart_ns / frames)


def _rests(offsets: Sequence[int]) -> bool:
    """Return whether the older half of the offsets [ns] has the median of the newer one."""
    half = len(offsets) // 2
    if half < _FEWEST_OF_HALF:
        return True
    older, newer = quantiles(offsets[:half]), quantiles(offsets[half:])
    spread = max(older[2] - older[0], newer[2] - newer[0])
    return abs(newer[1] - older[1]) <= max(_REST_NS, spread)
