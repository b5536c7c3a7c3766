"""Rejects heights that the drone cannot have reached: echoes of another drone's ultrasound. Pure."""

from groundstation.time_units import NS_PER_MS, NS_PER_S

# The fastest climb of a drone, and the step that noise and the ultrasound's own jumps explain.
_RATE_M_S = 2.0
_STEP_M = 0.15
_LONGEST_S = 0.1
# Readings that agree for this long are true: a table below, or a bad start.
_INSIST_NS = 400 * NS_PER_MS
# After a pause of this length the last height no longer counts.
_FORGET_NS = NS_PER_S


class HeightWatch:
    """Accepts a height if the drone can have reached it from the last good one.

    refused: number of rejected heights. steps: number of new levels accepted because they lasted.
    """

    def __init__(self) -> None:
        self.refused = self.steps = 0
        self._good: tuple[int, float] | None = None
        self._other: tuple[int, float] | None = None
        self._other_since_ns = 0

    def accept(self, stamp_ns: int, height_m: float) -> bool:
        """Return whether a height [m; above ground] is plausible."""
        if self._good is None or stamp_ns - self._good[0] > _FORGET_NS or _reachable(self._good, stamp_ns, height_m):
            self._good, self._other = (stamp_ns, height_m), None
            return True
        if self._other is None or not _reachable(self._other, stamp_ns, height_m):
            self._other_since_ns = stamp_ns
        self._other = (stamp_ns, height_m)
        if stamp_ns - self._other_since_ns < _INSIST_NS:
            self.refused += 1
            return False
        self._good, self._other = self._other, None
        self.steps += 1
        return True


def _reachable(before: tuple[int, float], stamp_ns: int, height_m: float) -> bool:
    # Longer silences are left to `_INSIST_NS`: an echo may last as long.
    elapsed_s = min((stamp_ns - before[0]) * 1e-9, _LONGEST_S)
    return abs(height_m - before[1]) <= _STEP_M + _RATE_M_S * elapsed_s
