"""Roll and pitch of vehicles in the recent past, to be read at a picture's exposure."""

from bisect import bisect_left
from collections import defaultdict
from operator import itemgetter

from groundstation.time_units import NS_PER_MS

_FARTHEST_NS = 200 * NS_PER_MS
# A stamp that is more ahead of now is wrong, and would keep all later samples out.
_FUTURE_NS = 100 * NS_PER_MS
_stamp_of = itemgetter(0)


class AttitudeHistory:
    """The samples of each entity over the last `span_ns`; pure values."""

    def __init__(self, span_ns: int) -> None:
        self._span_ns = span_ns
        self._samples: defaultdict[str, list[tuple[int, float, float]]] = defaultdict(list)

    def add(self, entity: str, stamp_ns: int, roll_rad: float, pitch_rad: float, now_ns: int) -> None:
        """Remember a sample; one older than the newest is ignored, and one from the future."""
        samples = self._samples[entity]
        if stamp_ns > now_ns + _FUTURE_NS or (samples and stamp_ns <= samples[-1][0]):
            return
        samples.append((stamp_ns, roll_rad, pitch_rad))
        if samples[0][0] < stamp_ns - self._span_ns:
            del samples[0]

    def at(self, entity: str, stamp_ns: int) -> tuple[float, float] | None:
        """Return (roll, pitch) at a time, interpolated; None when no sample is within 0.2 s of it."""
        samples = self._samples.get(entity)
        if not samples:
            return None
        place = bisect_left(samples, stamp_ns, key=_stamp_of)
        before, after = samples[max(0, place - 1)], samples[min(place, len(samples) - 1)]
        nearest = min((before, after), key=lambda sample: abs(sample[0] - stamp_ns))
        if abs(nearest[0] - stamp_ns) > _FARTHEST_NS:
            return None
        if not before[0] < stamp_ns < after[0]:
            return nearest[1], nearest[2]
        share = (stamp_ns - before[0]) / (after[0] - before[0])
        return before[1] + share * (after[1] - before[1]), before[2] + share * (after[2] - before[2])
