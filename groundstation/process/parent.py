"""Detects a dead parent within milliseconds, for any cause of death, or ends with it."""

import ctypes
import os
import select
import signal
from contextlib import suppress

_PR_SET_PDEATHSIG = 1


def end_with(parent_pid: int) -> None:
    """Have this process killed as soon as the thread of its parent that started it ends; at once, if it has ended."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent_pid:
        os.kill(os.getpid(), signal.SIGKILL)


class ParentWatch:
    """Watches whether the process that started this one still lives.

    Uses a pidfd, which becomes readable when the parent ends and cannot be fooled by a reused pid. Where the
    kernel has none, a changed parent pid is noticed when asked.
    """

    def __init__(self, expected_pid: int = 0) -> None:
        self._pid = expected_pid or os.getppid()
        self.descriptor = -1
        if hasattr(os, "pidfd_open"):
            with suppress(OSError):
                self.descriptor = os.pidfd_open(self._pid)
        # The parent may have died before the pidfd was opened: then its pid is no longer ours.
        self._dead = os.getppid() != self._pid
        self._poll = select.poll()
        if self.descriptor >= 0:
            self._poll.register(self.descriptor, select.POLLIN)

    @property
    def alive(self) -> bool:
        """Return whether the parent lives; once False it stays False."""
        if not self._dead:
            self._dead = bool(self._poll.poll(0)) if self.descriptor >= 0 else os.getppid() != self._pid
        return not self._dead

    def close(self) -> None:
        """Release the descriptor; idempotent."""
        if self.descriptor >= 0:
            os.close(self.descriptor)
            self.descriptor = -1
            self._dead = True
