"""The clock that message stamps are read from: this host's boot clock, or that of the run's host."""

import time
from collections.abc import Callable
from functools import cache
from pathlib import Path


class _Followed:
    """The clock of another host, read by the measured offset; it never goes back."""

    def __init__(self, name: str, offset_ns: Callable[[], int]) -> None:
        self.name = name
        self._offset_ns = offset_ns
        self._last_ns = 0

    def now_ns(self) -> int:
        # Two threads that read at once may differ by the microseconds of an offset correction; that is harmless.
        self._last_ns = max(self._last_ns, time.monotonic_ns() + self._offset_ns())
        return self._last_ns


_followed: _Followed | None = None


def follow(clock: str, offset_ns: Callable[[], int]) -> None:
    """Read the clock of the run's host from now on, in this process.

    offset_ns: returns the offset to add to this host's boot clock [ns].
    """
    global _followed
    _followed = _Followed(clock, offset_ns)


def follow_none() -> None:
    """Read this host's own boot clock again."""
    global _followed
    _followed = None


def now_ns() -> int:
    """Return the time [ns since the boot of the host whose clock this is]."""
    return time.monotonic_ns() if _followed is None else _followed.now_ns()


def own_ns() -> int:
    """Return the time of this host's own boot clock [ns]."""
    return time.monotonic_ns()


def clock_id() -> str:
    """Return the id of the clock that `now_ns` reads; two stamps are comparable only if their ids agree."""
    return own_id() if _followed is None else _followed.name


@cache
def own_id() -> str:
    """Return the id of this host's boot clock; in a time namespace it includes the shift [s]."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()[:8]
    except OSError:
        return "local"
    try:
        shift_s = int(Path("/proc/self/timens_offsets").read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return boot
    return f"{boot}{shift_s:+d}" if shift_s else boot


def unix_offset_ns() -> int:
    """Return UNIX time minus the time of this clock [ns], for recordings only."""
    return time.time_ns() - now_ns()
