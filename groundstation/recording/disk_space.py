"""The space left on the disk, and the data to omit when it runs low."""

import os
from enum import IntEnum
from pathlib import Path


class Space(IntEnum):
    """Levels of free disk space, by the data that may still be written, from best to worst."""

    AMPLE = 0
    LOW = 1
    NO_IMAGES = 2
    FULL = 3


# LOW only warns; below FULL no new file is begun (an open one goes on until the kernel refuses).
LIMITS_BYTES = {Space.LOW: 1_000_000_000, Space.NO_IMAGES: 200_000_000, Space.FULL: 20_000_000}
# A level is left only when this much more is free, so that it does not flap at the border.
_HYSTERESIS = 1.1


def assess(free: int, before: Space = Space.AMPLE) -> Space:
    """Return the level for a number of free bytes, given the previous level."""
    level = Space.AMPLE
    for candidate, limit in LIMITS_BYTES.items():
        if free < limit * (_HYSTERESIS if before >= candidate else 1.0):
            level = candidate
    return level


def free_bytes(folder: Path) -> int:
    """Return the bytes that an ordinary user may still write there; raises OSError if the folder is gone."""
    facts = os.statvfs(folder)
    return facts.f_bavail * facts.f_frsize
