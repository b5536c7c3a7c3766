"""Detects a dead supervisor within milliseconds, for any cause of death."""

import os
import select
from contextlib import suppress


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
