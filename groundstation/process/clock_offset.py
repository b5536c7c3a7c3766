"""Measures the offset of another host's clock by the quickest round trips. Pure; times in ns.

A round trip bounds the offset by half of its delay in any network, and the quickest of each second is nearly
free of queues. The remaining error, half of the difference between the two ways, cannot be measured.
"""

from collections import deque
from dataclasses import dataclass

from groundstation.time_units import NS_PER_MS, NS_PER_S

# Clocks of two computers diverge by at most 50 us in a second; the line through half a minute follows that.
_SECONDS, _LINE_S = 32, 8
_TRIPS_TO_START = 10
_STEADIEST_NS = 200_000.0
_DRIFT_LIMIT = 200e-6
_MARGIN_NS = NS_PER_MS  # stamps are taken beside the bus, not in it
# Corrections by which a followed clock is led to its offset; beyond _STEP_NS the clock was set.
_SLEW_PER_S, _STEP_NS = 500e-6, 20 * NS_PER_MS


@dataclass(frozen=True, slots=True)
class RoundTrip:
    """A request and its answer: sent and received by our clock, received and answered by the other one."""

    sent_ns: int
    received_ns: int
    answered_ns: int
    heard_ns: int

    @property
    def offset_ns(self) -> int:
        """Return the offset to add to our clock to read the other one, if both ways took equally long."""
        return (self.received_ns - self.sent_ns + self.answered_ns - self.heard_ns) // 2

    @property
    def delay_ns(self) -> int:
        """Return the delay of both ways together, without the time at the other end."""
        return self.heard_ns - self.sent_ns - (self.answered_ns - self.received_ns)


class OffsetFilter:
    """Keeps the quickest round trip of each second, and the line through them, since a clock was last set."""

    def __init__(self) -> None:
        self._trips = 0
        self._quickest: deque[RoundTrip] = deque(maxlen=_SECONDS)

    def take(self, trip: RoundTrip) -> None:
        """Take one round trip; an impossible one (a clock was set meanwhile, or an answer is false) is ignored."""
        if trip.delay_ns < 0 or trip.answered_ns < trip.received_ns:
            return
        self._trips += 1
        if self._quickest and _contradict(trip, self._quickest[-1]):
            self._quickest.clear()  # a host slept meanwhile: its boot clock stood still
        last = self._quickest[-1] if self._quickest else None
        if last is None or trip.sent_ns // NS_PER_S != last.sent_ns // NS_PER_S:
            self._quickest.append(trip)
        elif trip.delay_ns <= last.delay_ns:
            self._quickest[-1] = trip

    @property
    def known(self) -> bool:
        """Return whether there were enough round trips."""
        return self._trips >= _TRIPS_TO_START

    @property
    def error_ns(self) -> int:
        """Return the largest error of the offset: half of the quickest round trip."""
        return min(trip.delay_ns for trip in self._quickest) // 2

    def offset_ns(self, now_ns: int) -> int:
        """Return the offset to add to our clock now; only once `known`."""
        trips = self._quickest
        quickest_ns = min(trip.delay_ns for trip in trips)
        weights = [(_STEADIEST_NS / (_STEADIEST_NS + trip.delay_ns - quickest_ns)) ** 2 for trip in trips]
        base_ns, whole = trips[0].offset_ns, sum(weights)
        times_s = [(trip.sent_ns - now_ns) / NS_PER_S for trip in trips]
        offsets = [float(trip.offset_ns - base_ns) for trip in trips]
        mean_s = sum(w * t for w, t in zip(weights, times_s, strict=True)) / whole
        mean = sum(w * o for w, o in zip(weights, offsets, strict=True)) / whole
        drift = 0.0
        if times_s[-1] - times_s[0] >= _LINE_S:
            spread = sum(w * (t - mean_s) ** 2 for w, t in zip(weights, times_s, strict=True))
            lean = sum(w * (t - mean_s) * (o - mean) for w, t, o in zip(weights, times_s, offsets, strict=True))
            limit = _DRIFT_LIMIT * NS_PER_S
            drift = max(-limit, min(limit, lean / spread)) if spread > 0.0 else 0.0
        return base_ns + round(mean - drift * mean_s)


def _contradict(one: RoundTrip, other: RoundTrip) -> bool:
    """Return whether no offset explains both: each is accurate to half its delay, and clocks diverge slowly."""
    apart_ns = abs(one.offset_ns - other.offset_ns)
    drifted_ns = _DRIFT_LIMIT * abs(one.sent_ns - other.sent_ns)
    return apart_ns > (one.delay_ns + other.delay_ns) / 2 + drifted_ns + _MARGIN_NS


def led(offset_ns: int, wanted_ns: int, elapsed_s: float) -> int:
    """Return the next offset of a clock that is led to the wanted one slowly, or at once where it was set."""
    error_ns = wanted_ns - offset_ns
    if abs(error_ns) > _STEP_NS:
        return wanted_ns
    most_ns = round(_SLEW_PER_S * elapsed_s * NS_PER_S)
    return offset_ns + max(-most_ns, min(most_ns, error_ns))
