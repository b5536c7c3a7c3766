"""Signals of the supervisor: Ctrl-C, SIGTERM and a closed terminal alike ask to land and stop; a second hurries.

Ctrl-\\ asks for it as well. Ctrl-Z only prints a line: a supervisor with drones in the air cannot be suspended.
"""

import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

from groundstation.time_units import NS_PER_MS

# `timeout` and some shells signal a process twice at once; a person's second press takes longer.
_SAME_WISH_NS = 500 * NS_PER_MS
_WISHES = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
# Ignored: a closed reader of our output, and the stop of a background program of a terminal.
_UNHEEDED = (signal.SIGPIPE, signal.SIGTTIN, signal.SIGTTOU)
NOT_PUT_ASIDE = (
    "Ctrl-Z does nothing here: a stopped ground station would watch over nobody. Ctrl-C lands all drones and ends; "
    "for another command open another terminal (groundstation hold, land)"
)


class Interrupts:
    """Counts the operator's requests to stop; `descriptor` becomes readable when one arrives."""

    def __init__(self) -> None:
        self.descriptor, self._write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        self._first_ns = 0
        self._put_aside = False
        self.stop_requested = False
        self.hurry = False

    def install(self) -> None:
        """Take over the signals of this process; main thread only."""
        for number in _WISHES:
            signal.signal(number, self._on_signal)
        for number in _UNHEEDED:
            signal.signal(number, signal.SIG_IGN)
        # Where our starter ignored it, the kernel would forget a child at its end, and with it the exit code.
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        signal.signal(signal.SIGTSTP, self._on_put_aside)
        signal.set_wakeup_fd(self._write, warn_on_full_buffer=False)

    def _on_signal(self, number: int, _frame: FrameType | None) -> None:
        now_ns = time.monotonic_ns()
        if not self.stop_requested:
            self.stop_requested, self._first_ns = True, now_ns
        # A closing terminal may hang up several times; that is never a second request.
        elif number != signal.SIGHUP and now_ns - self._first_ns > _SAME_WISH_NS:
            self.hurry = True

    def _on_put_aside(self, _number: int, _frame: FrameType | None) -> None:
        self._put_aside = True

    def clear(self) -> str:
        """Empty the descriptor after it woke a poll; return a notice for the operator, or ""."""
        with suppress(BlockingIOError):
            os.read(self.descriptor, 512)
        told, self._put_aside = NOT_PUT_ASIDE * self._put_aside, False
        return told

    def close(self) -> None:
        """Release the descriptors; signals are still only counted, so that none kills the last steps."""
        signal.set_wakeup_fd(-1)
        os.close(self.descriptor)
        os.close(self._write)


@contextmanager
def put_aside_by_nobody() -> Iterator[None]:
    """Ignore Ctrl-Z while a process is started, which inherits that: a handler is not inherited. Main thread only."""
    kept = signal.getsignal(signal.SIGTSTP)
    if not callable(kept):  # no handler is set, and an ignored signal is inherited anyway
        yield
        return
    signal.signal(signal.SIGTSTP, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGTSTP, kept)
