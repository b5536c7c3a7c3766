"""Ends a program that only observes a run at one Ctrl-C, even while it waits."""

import os
import signal
import threading

_WISHES = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class LeavingSignal:
    """The wish to leave, which no library can swallow as it can an exception; a second one ends the process at once."""

    def __init__(self) -> None:
        self.requested = False

    def install(self) -> None:
        """Take over the signals of this process; main thread only."""
        for number in _WISHES:
            signal.signal(number, self._on_signal)

    def _on_signal(self, _number: int, _frame: object) -> None:
        self.requested = True
        for number in _WISHES:
            # The kernel's own action: native code that waits for a link would never come back to a handler.
            signal.signal(number, signal.SIG_DFL)


def leave_within(limit_s: float, code: int) -> None:
    """End this process with an exit code if it is still there after a time: a stalled link holds its close for long."""
    timer = threading.Timer(limit_s, os._exit, (code,))
    timer.daemon = True
    timer.start()
