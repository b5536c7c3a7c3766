"""Lines for the operator that can neither block nor kill the supervisor: the terminal may be stopped or gone."""

import os
import queue
import threading
import time

from groundstation.appearance.plain_text import plain

_STDOUT = 1


class Terminal:
    """Writes lines from a thread of its own; while `muted` (the monitor owns the screen) it keeps them back."""

    def __init__(self, descriptor: int = _STDOUT) -> None:
        self._descriptor = descriptor
        self._lines: queue.Queue[bytes] = queue.Queue(maxsize=1000)
        self._kept: list[str] = []
        self.muted = False
        self._thread = threading.Thread(target=self._write_all, name="terminal", daemon=True)
        self._thread.start()

    def say(self, text: str) -> None:
        """Show a line, without control characters but line ends; drops it if the terminal accepts none."""
        if self.muted:
            self._kept = [*self._kept[-200:], text]
            return
        try:
            self._lines.put_nowait(plain(text).encode(errors="replace") + b"\n")
        except queue.Full:
            return

    def unmute(self) -> None:
        """Take the screen back and show the lines kept."""
        self.muted = False
        kept, self._kept = self._kept, []
        for text in kept:
            self.say(text)

    def flush(self, limit_s: float = 1.0) -> None:
        """Give the terminal a moment to accept waiting lines."""
        deadline = time.monotonic() + limit_s
        while self._lines.unfinished_tasks and self._thread.is_alive() and time.monotonic() < deadline:
            time.sleep(0.01)

    def _write_all(self) -> None:
        gone = False
        while True:
            line = self._lines.get()
            try:
                while line and not gone:
                    line = line[os.write(self._descriptor, line) :]
            except BlockingIOError:
                time.sleep(0.05)
            except OSError:
                gone = True  # the terminal was closed; the landing goes on without an audience
            self._lines.task_done()
