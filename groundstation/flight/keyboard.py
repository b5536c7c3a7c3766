"""The operator's keyboard at the prompt of a run: whole lines, without ever waiting for one."""

import os
import select
import termios
from contextlib import suppress

_STDIN = 0


class Keyboard:
    """Input typed into a terminal, or from a pipe. gone: whether it has ended."""

    def __init__(self, descriptor: int = _STDIN) -> None:
        self._descriptor = descriptor
        self._typed = b""
        self.gone = False

    def forget(self) -> None:
        """Drop input typed into a terminal before the prompt: it was not an answer to it."""
        self._typed = b""
        with suppress(OSError, termios.error):  # no terminal: a pipe was filled on purpose
            termios.tcflush(self._descriptor, termios.TCIFLUSH)

    def line(self) -> bytes | None:
        """Return the next line without the blanks around it, None while there is none."""
        if self.gone or not select.select([self._descriptor], [], [], 0)[0]:
            return None
        try:
            # os.read and not input(): nothing here may block the watch over the processes.
            data = os.read(self._descriptor, 4096)
        except OSError:
            return None  # a run in the background: another program has the keyboard now
        self.gone = not data
        line, ended, _ = (self._typed + data).partition(b"\n")
        self._typed = b"" if ended else line
        return line.strip() if ended else None
