"""The time by which frames are signed, read once of the computer's clock and counted on: setting that changes nothing.

No pymavlink here: the guardian is small.
"""

import time

from drivers.mavlink.wire.signature import stamp_at


class SigningClock:
    """UNIX time when it was made, and the time since then; that of a sleeping computer counts."""

    def __init__(self) -> None:
        self._began_s = time.time() - _since_boot_s()

    def stamp(self) -> int:
        """Return the time of signing [10 us since 2015-01-01 UTC], 0 for a clock that was never set."""
        return max(0, stamp_at(self._began_s + _since_boot_s()))


def _since_boot_s() -> float:
    return time.clock_gettime(time.CLOCK_BOOTTIME)
