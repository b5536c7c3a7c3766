"""Whether the processors had idle time: without it, a missed deadline proves nothing about the program."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

# Where less than this share of all processors was idle, detectors wait for them, and drones land for want of pictures.
ENOUGH = 0.15


class SpareTime:
    """Measures from when it is made."""

    def __init__(self) -> None:
        self._before = _ticks()

    @property
    def share(self) -> float:
        """Return for which share of the time processors were idle."""
        idle, total = (after - then for after, then in zip(_ticks(), self._before, strict=True))
        return idle / max(1, total)


@contextmanager
def needing_processors() -> Iterator[None]:
    """Skip what fails within, where processors had no time to spare meanwhile."""
    spare = SpareTime()
    try:
        yield
    except AssertionError as fault:
        if spare.share < ENOUGH:
            pytest.skip(f"the machine was full ({spare.share:.0%} idle), so nothing is shown: {fault}")
        raise


def _ticks() -> tuple[int, int]:
    """Return the ticks for which the processors were idle, and all ticks, since the system's start."""
    ticks = [int(text) for text in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]]
    return ticks[3] + ticks[4], sum(ticks)
