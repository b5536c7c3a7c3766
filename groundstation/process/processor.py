"""How much of the processor processes, and the whole computer, used and waited for."""

import os
import time
from contextlib import suppress
from pathlib import Path

_PROC = Path("/proc")
_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_IDLE = slice(3, 5)  # idle, and idle while a disk works
_COUNTED = slice(0, 8)  # from user to steal; guests' time counts as user already


class OwnUse:
    """Use of the processor by this process since the last question."""

    def __init__(self) -> None:
        self._mark = self._now()

    def since(self) -> tuple[float, float]:
        """Return how many cores it used, and the share of the time for which its main thread waited for one."""
        before, self._mark = self._mark, self._now()
        elapsed, used, waited = (now - then for now, then in zip(self._mark, before, strict=True))
        return (used / elapsed, waited / elapsed) if elapsed > 0 else (0.0, 0.0)

    @staticmethod
    def _now() -> tuple[int, int, int]:
        return time.monotonic_ns(), time.process_time_ns(), waited_ns()


def waited_ns(task: str = "self") -> int:
    """Return for how long a task was ready to run and had no core [ns]; 0 if the kernel does not report it.

    task: its folder below /proc; "self" is this process's main thread.
    """
    try:
        return int((_PROC / task / "schedstat").read_text().split()[1])
    except (OSError, IndexError, ValueError):
        return 0


def all_waited_ns(pid: int) -> int:
    """Return the sum of `waited_ns` over all threads of a process [ns]."""
    with suppress(OSError):
        return sum(waited_ns(f"{pid}/task/{each.name}") for each in (_PROC / str(pid) / "task").iterdir())
    return 0


def busy_s() -> float | None:
    """Return the time that all cores of this computer were busy, since it started [s]; None if it is not reported."""
    try:
        head, *times = (_PROC / "stat").read_text().partition("\n")[0].split()
        counted = [int(each) for each in times[_COUNTED]]
    except (OSError, ValueError):
        return None
    return (sum(counted) - sum(counted[_IDLE])) / _TICKS_PER_S if head == "cpu" else None
