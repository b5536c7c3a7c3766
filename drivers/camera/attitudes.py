"""Roll and pitch of vehicles in the recent past, to be read at a picture's exposure."""

from collections import defaultdict, deque

from groundstation.time_units import NS_PER_MS

_MOST_SAMPLES = 64
_FARTHEST_NS = 200 * NS_PER_MS


class AttitudeHistory:
    """A short history per entity; pure values."""

    def __init__(self) -> None:
        self._samples: defaultdict[str, deque[tuple[int, float, float]]] = defaultdict(
            lambda: deque(maxlen=_MOST_SAMPLES)
        )

    def add(self, entity: str, stamp_ns: int, roll_rad: float, pitch_rad: float) -> None:
        """Remember a sample; one older than the newest is ignored."""
        samples = self._samples[entity]
        if not samples or stamp_ns > samples[-1][0]:
            samples.append((stamp_ns, roll_rad, pitch_rad))

    def at(self, entity: str, stamp_ns: int) -> tuple[float, float] | None:
        """Return (roll, pitch) at a time, interpolated; None when no sample is within 0.2 s of it."""
        samples = self._samples.get(entity)
        if not samples:
            return None
        before = after = samples[-1]
        for sample in reversed(samples):
            before = sample
            if sample[0] <= stamp_ns:
                break
            after = sample
        nearest = min((before, after), key=lambda sample: abs(sample[0] - stamp_ns))
        if abs(nearest[0] - stamp_ns) > _FARTHEST_NS:
            return None
        if not before[0] < stamp_ns < after[0]:
            return nearest[1], nearest[2]
        share = (stamp_ns - before[0]) / (after[0] - before[0])
        return before[1] + share * (after[1] - before[1]), before[2] + share * (after[2] - before[2])
