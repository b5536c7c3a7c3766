"""Measures the offset of another host's clock by the quickest round trips. Pure; times in ns.

A round trip bounds the offset by half of its delay in any network, and the quickest of each second is nearly
free of queues. The remaining error, half of the difference between the two ways, cannot be measured.
"""

import math
from collections import deque
from dataclasses import dataclass

from groundstation.time_units import NS_PER_MS, NS_PER_S

# Undisturbed clocks of two computers diverge by at most 50 us in a second; the line through half a minute follows that.
_SECONDS, _LINE_S = 32, 8
_TRIPS_TO_START = 10
_STEADIEST_NS = 200_000.0
# As fast as the kernel slews a clock; chrony slews some faster, which contradicting round trips show.
_DRIFT_LIMIT, _FASTEST_DRIFT = 500e-6, 0.01
_MARGIN_NS = NS_PER_MS  # stamps are taken beside the bus, not in it
# Corrections by which a followed clock is led to its offset: faster than clocks diverge, or it would never get there.
_SLEW_PER_S, _STEP_NS = 1000e-6, 20 * NS_PER_MS
# It never goes back, nor stands still for long: its loops and limits of silence would.
_BACK_PER_S, _BACK_MOST_S = 0.5, 0.1


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
        self._contradicted_ns = -math.inf
        self._quickest: deque[RoundTrip] = deque(maxlen=_SECONDS)

    def take(self, trip: RoundTrip) -> None:
        """Take one round trip; an impossible one (a clock was set meanwhile, or an answer is false) is ignored."""
        if trip.delay_ns < 0 or trip.answered_ns < trip.received_ns:
            return
        self._trips += 1
        if any(_contradict(trip, one) for one in self._quickest):
            # A host slept meanwhile: its boot clock stood still. Trips that waited for it contradict neither offset.
            self._quickest = deque((one for one in self._quickest if not _contradict(trip, one)), _SECONDS)
            self._contradicted_ns = trip.sent_ns
        last = self._quickest[-1] if self._quickest else None
        if last is None or trip.sent_ns // NS_PER_S != last.sent_ns // NS_PER_S:
            self._quickest.append(trip)
        elif trip.delay_ns <= last.delay_ns:
            self._quickest[-1] = trip

    @property
    def known(self) -> bool:
        """Return whether there were enough round trips."""
        return self._trips >= _TRIPS_TO_START

    def error_ns(self, used_ns: int, now_ns: int) -> int:
        """Return the largest error that an offset in use can have now."""
        best_ns, error_ns = self._best(now_ns)
        return abs(best_ns - used_ns) + error_ns

    def offset_ns(self, now_ns: int) -> int:
        """Return the offset to add to our clock now; only once `known`."""
        mean_s, mean_ns, drift = self._line(now_ns)
        limit = _DRIFT_LIMIT * NS_PER_S
        line_ns = self._quickest[0].offset_ns + round(mean_ns - max(-limit, min(limit, drift)) * mean_s)
        best_ns, error_ns = self._best(now_ns)
        return max(best_ns - error_ns, min(best_ns + error_ns, line_ns))

    def _best(self, now_ns: int) -> tuple[int, int]:
        """Return the offset of the trip that tells it most precisely now, and the largest error of that."""
        lately = now_ns - self._contradicted_ns < _LINE_S * NS_PER_S
        least = _FASTEST_DRIFT if lately else _DRIFT_LIMIT
        drift = max(least, abs(self._line(now_ns)[2]) / NS_PER_S)
        errors = [(trip.delay_ns / 2 + drift * abs(now_ns - trip.sent_ns), trip.offset_ns) for trip in self._quickest]
        error_ns, best_ns = min(errors)
        return best_ns, math.ceil(error_ns)

    def _line(self, now_ns: int) -> tuple[float, float, float]:
        """Return the mean time [s from now], the mean offset there [ns from the first trip's], and the drift [ns/s]."""
        trips = self._quickest
        quickest_ns = min(trip.delay_ns for trip in trips)
        weights = [(_STEADIEST_NS / (_STEADIEST_NS + trip.delay_ns - quickest_ns)) ** 2 for trip in trips]
        base_ns, whole = trips[0].offset_ns, sum(weights)
        times_s = [(trip.sent_ns - now_ns) / NS_PER_S for trip in trips]
        offsets = [float(trip.offset_ns - base_ns) for trip in trips]
        mean_s = sum(w * t for w, t in zip(weights, times_s, strict=True)) / whole
        mean_ns = sum(w * o for w, o in zip(weights, offsets, strict=True)) / whole
        if times_s[-1] - times_s[0] < _LINE_S:
            return mean_s, mean_ns, 0.0
        spread = sum(w * (t - mean_s) ** 2 for w, t in zip(weights, times_s, strict=True))
        lean = sum(w * (t - mean_s) * (o - mean_ns) for w, t, o in zip(weights, times_s, offsets, strict=True))
        return mean_s, mean_ns, lean / spread if spread > 0.0 else 0.0


def _contradict(one: RoundTrip, other: RoundTrip) -> bool:
    """Return whether no offset explains both: each is accurate to half its delay, and clocks diverge slowly."""
    apart_ns = abs(one.offset_ns - other.offset_ns)
    drifted_ns = _DRIFT_LIMIT * abs(one.sent_ns - other.sent_ns)
    return apart_ns > (one.delay_ns + other.delay_ns) / 2 + drifted_ns + _MARGIN_NS


def led(offset_ns: int, wanted_ns: int, elapsed_s: float, rests: bool = False) -> int:
    """Return the next offset of a clock that is led to the wanted one: slowly, or at once where it is far behind.

    One that is far ahead runs at half speed. rests: nobody flies, so small corrections need not be slow.
    """
    error_ns = wanted_ns - offset_ns
    if error_ns > _STEP_NS or (rests and error_ns >= -_STEP_NS):
        return wanted_ns
    if error_ns < -_STEP_NS:
        return offset_ns - min(-error_ns, round(_BACK_PER_S * min(elapsed_s, _BACK_MOST_S) * NS_PER_S))
    most_ns = round(_SLEW_PER_S * elapsed_s * NS_PER_S)
    return offset_ns + max(-most_ns, min(most_ns, error_ns))
