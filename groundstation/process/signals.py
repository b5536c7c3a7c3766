"""Signals of a child: SIGINT belongs to the terminal and is ignored, SIGTERM and SIGHUP ask it to stop."""

import os
import select
import signal
import time
from contextlib import suppress

from groundstation.bus import clock
from groundstation.process.parent import ParentWatch


class StopSignal:
    """The request to stop, and a sleep that ends early at the request, the parent's death, or `wake`.

    Each of them ends only one sleep: a driver that must still land after a stop keeps its loop rate.
    """

    def __init__(self, parent: ParentWatch) -> None:
        self.requested = False
        self._nudged = False
        self._parent = parent
        self._parent_reported = False
        self._read, self._write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)

    def install(self) -> None:
        """Take over the signals of this process; main thread only."""
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        for number in (signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, self._request)
        # The kernel may deliver the signal to a network thread; the wake-up descriptor ends the sleep all the same.
        signal.set_wakeup_fd(self._write, warn_on_full_buffer=False)

    def _request(self, _number: int, _frame: object) -> None:
        self.requested = True

    def wake(self) -> None:
        """End a sleep early, the one under way or the next; from any thread, never blocks."""
        self._nudged = True
        with suppress(OSError):  # a full pipe wakes as well
            os.write(self._write, b"\0")

    def sleep_until(self, deadline_ns: int) -> bool:
        """Sleep until a time of the bus clock or `wake`; False when a stop or the parent's death ended the sleep."""
        watched = [self._read]
        if self._parent.descriptor >= 0 and not self._parent_reported:
            watched.append(self._parent.descriptor)
        # The bus clock may be corrected meanwhile, by as much as another host slept: this host's own measures the wait.
        own_ns = time.monotonic_ns() + deadline_ns - clock.now_ns()
        # select, unlike poll, takes less than a millisecond: one wait and one wake-up for each sleep.
        while True:
            left_ns = 0 if self._nudged else max(0, own_ns - time.monotonic_ns())
            if self._woken(select.select(watched, (), (), left_ns / 1e9)[0]):
                return False
            if self._nudged or time.monotonic_ns() >= own_ns:
                self._nudged = False
                return True

    def _woken(self, ready: list[int]) -> bool:
        woken = False
        for descriptor in ready:
            if descriptor == self._read:
                # The interpreter writes the numbers of signals, `wake` writes zeros.
                with suppress(BlockingIOError):
                    signalled = any(os.read(self._read, 512))
                    woken |= signalled and self.requested
            elif not self._parent_reported:
                self._parent_reported = woken = True
        return woken

    def close(self) -> None:
        """Restore the signal handlers; idempotent."""
        if self._read >= 0:
            signal.set_wakeup_fd(-1)
            os.close(self._read)
            os.close(self._write)
            self._read = self._write = -1
