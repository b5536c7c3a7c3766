"""Whether the processors had idle time: without it, a missed deadline proves nothing about the program."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

# With a smaller idle share of all processors, detectors wait for them, and drones land for want of pictures.
ENOUGH = 0.15


class SpareTime:
    """Measures from its creation."""

    def __init__(self) -> None:
        self._before = _ticks()

    @property
    def share(self) -> float:
        """Return the share of time in which processors were idle."""
        idle, total = (after - then for after, then in zip(_ticks(), self._before, strict=True))
        return idle / max(1, total)


@contextmanager
def needing_processors() -> Iterator[None]:
    """Skip a test that fails within, if the processors had no idle time meanwhile."""
    spare = SpareTime()
    try:
        yield
    except AssertionError as fault:
        if spare.share < ENOUGH:
            pytest.skip(f"the machine was full ({spare.share:.0%} idle), so nothing is shown: {fault}")
        raise


def _ticks() -> tuple[int, int]:
    """Return the processors' idle ticks, and all ticks, since the system's start."""
    ticks = [int(text) for text in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]]
    return ticks[3] + ticks[4], sum(ticks)
