"""The host's boot clock: the only clock that message stamps are read from."""

import time
from functools import cache
from pathlib import Path


def now_ns() -> int:
    """Return the monotonic time of this host [ns since boot]."""
    return time.monotonic_ns()


@cache
def clock_id() -> str:
    """Return the id of this host's boot clock; two stamps are comparable only if their ids agree."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text().strip()[:8]
    except OSError:
        return "local"


def unix_offset_ns() -> int:
    """Return UNIX time minus monotonic time [ns], for recordings only."""
    return time.time_ns() - time.monotonic_ns()
