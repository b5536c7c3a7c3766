"""Decides when a whole picture is searched: seldom while all is tracked.

For missing markers, as often as CPU permits.
"""

from dataclasses import dataclass

from drivers.camera.settings import DetectorSettings
from groundstation.time_units import NS_PER_S


@dataclass(frozen=True, slots=True)
class SearchRates:
    """How often a camera searches whole pictures [Hz], and the permitted cost.

    idle_hz: while no marker is in view, so that the camera is not taken for a dead one; half of it while one is in view
    and another is missing; tracked_hz: while none is missing; sought_hz: while a sought one is not in view; share: of a
    processor's time then, unless `idle_hz` costs more.
    """

    tracked_hz: float
    idle_hz: float
    sought_hz: float
    share: float

    @classmethod
    def of(cls, detector: DetectorSettings, idle_hz: float) -> "SearchRates":
        """Return the rates from the settings of a camera's driver."""
        return cls(detector.tracked_search_rate_hz, idle_hz, detector.sought_search_rate_hz, detector.search_share)


class WholeSearches:
    """Schedule of one camera's whole searches, by times of exposure [ns].

    Ask `is_due` for each picture; call `done` after each search, and `lost` when a marker is no longer tracked.
    """

    def __init__(self, rates: SearchRates, phase_s: float) -> None:
        self._rates, self._phase_ns = rates, round(phase_s * NS_PER_S)
        self._next_ns: int | None = None
        self._done_ns: int | None = None
        self._cost_s = 0.0

    def is_due(self, stamp_ns: int, sees: bool, sought: bool) -> bool:
        """Return whether a whole picture is to be searched.

        sees: any expected marker is in view; sought: one that is not in view should be found soon.
        """
        if self._next_ns is None:
            self._next_ns = stamp_ns + self._phase_ns
        if self._done_ns is None:
            return sought or stamp_ns >= self._next_ns
        waited_ns = stamp_ns - self._done_ns
        blind = not sees and waited_ns >= round(NS_PER_S / self._rates.idle_hz)
        return blind or (sought and waited_ns >= self._eager_ns) or stamp_ns >= self._next_ns

    def done(self, stamp_ns: int, misses: bool, cost_s: float) -> None:
        """Record that a picture was searched, and the cost [s of CPU].

        misses: an expected marker is not in view, and its estimate is not elsewhere.
        """
        rate_hz = 0.5 * self._rates.idle_hz if misses else self._rates.tracked_hz
        self._cost_s, self._done_ns = cost_s, stamp_ns
        self._next_ns = stamp_ns + round(NS_PER_S / rate_hz)

    def lost(self, stamp_ns: int) -> None:
        """Search soon: a marker is not tracked any more that should be in view."""
        if self._next_ns is not None:
            soonest = (self._done_ns or 0) + round(NS_PER_S / (2.0 * self._rates.idle_hz))
            self._next_ns = min(self._next_ns, max(stamp_ns, soonest))

    @property
    def _eager_ns(self) -> int:
        """Return the least time between two full searches while a marker is sought [ns]."""
        rates = self._rates
        within_cost_s = max(1.0 / rates.sought_hz, self._cost_s / rates.share)
        return round(NS_PER_S * min(1.0 / rates.idle_hz, within_cost_s))
