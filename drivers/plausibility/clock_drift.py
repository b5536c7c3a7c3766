"""The rate of a vehicle's clock against ours, and how unevenly its packets arrive. Pure."""

import math
from collections import deque
from dataclasses import dataclass

from groundstation.time_units import NS_PER_MS, NS_PER_S

_SPAN_NS, _KEPT, _NEEDED = 500 * NS_PER_MS, 60, 8
_JUMP_NS = 10 * NS_PER_S
_KNOWN_PPM = 100.0  # a less certain drift is not reported


@dataclass(frozen=True, slots=True)
class ClockFigures:
    """drift_ppm: by how much the vehicle's clock runs faster than ours; late_ms: largest delay of
    a packet in the last 30 s, against the freshest of its half second [ms].
    """

    drift_ppm: float | None
    late_ms: float


class ClockDrift:
    """Fits a line through the freshest packet of each half second; `figures` is replaced as a whole, for other threads.

    If the clock jumps by more than 10 s or starts over, the comparison begins anew.
    """

    def __init__(self) -> None:
        self.figures: ClockFigures | None = None
        self._spans: deque[tuple[float, float, float]] = deque(maxlen=_KEPT)
        self._first_ns: int | None = None
        self._origin_ns = self._lag_ns = self._least_ns = self._most_ns = 0

    def update(self, stamp_ns: int, vehicle_ns: int) -> None:
        """Take the receipt of a packet and its time [vehicle]."""
        lag_ns = stamp_ns - vehicle_ns
        if self._first_ns is None or abs(lag_ns - self._least_ns) > _JUMP_NS:
            self._spans.clear()
            self.figures = None
            self._begin(stamp_ns, lag_ns)
        elif stamp_ns - self._first_ns >= _SPAN_NS:
            # In seconds since the first span and its lag, so that no digits are lost.
            at_s = (self._first_ns - self._origin_ns) * 1e-9
            self._spans.append((at_s, (self._least_ns - self._lag_ns) * 1e-9, (self._most_ns - self._least_ns) * 1e-6))
            self.figures = ClockFigures(_drift_ppm(self._spans), max(late for _, _, late in self._spans))
            self._first_ns, self._least_ns, self._most_ns = stamp_ns, lag_ns, lag_ns
        else:
            self._least_ns, self._most_ns = min(self._least_ns, lag_ns), max(self._most_ns, lag_ns)

    def _begin(self, stamp_ns: int, lag_ns: int) -> None:
        self._first_ns, self._origin_ns = stamp_ns, stamp_ns
        self._least_ns = self._most_ns = self._lag_ns = lag_ns


def _drift_ppm(spans: deque[tuple[float, float, float]]) -> float | None:
    """Return the negative slope of the least lags; None while it is uncertain."""
    count = len(spans)
    if count < _NEEDED:
        return None
    middle, mean = sum(at for at, _, _ in spans) / count, sum(lag for _, lag, _ in spans) / count
    spread = sum((at - middle) ** 2 for at, _, _ in spans)
    slope = sum((at - middle) * (lag - mean) for at, lag, _ in spans) / spread
    rest = sum((lag - mean - slope * (at - middle)) ** 2 for at, lag, _ in spans)
    deviation = math.sqrt(rest / (count - 2) / spread)
    return -1e6 * slope if 1e6 * deviation < _KNOWN_PPM else None
