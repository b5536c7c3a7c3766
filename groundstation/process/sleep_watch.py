"""Detects that this computer slept: all its processes stood still with their clock, so that none noticed."""

import time
from collections.abc import Callable

from groundstation.time_units import NS_PER_MS, NS_PER_S

# Both clocks are read within this, unless this process stood still in between.
_READ_NS = 5 * NS_PER_MS
# Waking takes longer; clock corrections are smaller.
_LEAST_S = 0.3


def _since_boot_ns() -> int:
    return time.clock_gettime_ns(time.CLOCK_BOOTTIME)


class SleepWatch:
    """Compares the clock that stands still in sleep, by which the bus is stamped, with the one that does not."""

    def __init__(
        self, awake_ns: Callable[[], int] = time.monotonic_ns, since_boot_ns: Callable[[], int] = _since_boot_ns
    ) -> None:
        self._awake_ns, self._since_boot_ns = awake_ns, since_boot_ns
        self._apart_ns: int | None = None

    def slept_s(self) -> float:
        """Return how long it slept since the last call [s]; 0.0 for a brief moment."""
        before_ns, boot_ns = self._awake_ns(), self._since_boot_ns()
        if self._awake_ns() - before_ns > _READ_NS:
            return 0.0  # the next call decides
        apart_ns = boot_ns - before_ns
        slept_s = 0.0 if self._apart_ns is None else (apart_ns - self._apart_ns) / NS_PER_S
        self._apart_ns = apart_ns
        return slept_s if slept_s >= _LEAST_S else 0.0
