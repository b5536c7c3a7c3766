"""One sensor's delay as found in a recording."""

from dataclasses import dataclass

# Fewer sightings than this determine no delay.
LEAST_SEEN = 60
_UNSURE_MS, _TOLERATED_MS = 15.0, 10.0


@dataclass(frozen=True, slots=True)
class Delay:
    """One sensor's delay: the setting, its value [ms], the measured delay and one sigma of it.

    reason: why it was not measured, or is not trusted. flight: the flight that would determine it.
    """

    sensor: str
    setting: str
    now_ms: float
    measured_ms: float | None = None
    std_ms: float | None = None
    reason: str = ""
    flight: str = ""

    @property
    def sure(self) -> bool:
        """Return whether the recording determines it to better than 15 ms."""
        return self.measured_ms is not None and self.std_ms is not None and self.std_ms <= _UNSURE_MS

    @property
    def differs(self) -> bool:
        """Return whether a trustworthy measurement contradicts the setting, by three sigmas and by more than 10 ms."""
        if self.measured_ms is None or self.std_ms is None or not self.sure or self.reason:
            return False
        return abs(self.measured_ms - self.now_ms) > max(_TOLERATED_MS, 3.0 * self.std_ms)
