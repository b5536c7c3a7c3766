"""Who was refused at the door of the bus: Zenoh says so on standard output, and nowhere else."""

import logging
import os
import threading
from collections.abc import Iterator

from groundstation.bus.zenoh_bus import REFUSED_BY

_PERIOD_NS = 10_000_000_000
_STDOUT = 1
_KEPT_LINES = 20
_log = logging.getLogger(__name__)


class RefusedStrangers:
    """Takes standard output over and counts what it says of refusals; the first lines of it go to the log.

    Nothing may ever wait for this reader: whatever comes is read at once.
    """

    def __init__(self) -> None:
        os.environ["NO_COLOR"] = "1"
        self._stdout = os.dup(_STDOUT)
        source, sink = os.pipe()
        os.dup2(sink, _STDOUT)
        os.close(sink)
        self._source = source
        self._heard = self._told = 0
        self._next_ns = 0
        self._reader = threading.Thread(target=self._read, name="refusals", daemon=True)
        self._reader.start()

    def take(self, now_ns: int) -> int:
        """Return how many were refused since the last time that it said so; at most once in 10 s, 0 otherwise."""
        fresh = self._heard - self._told
        if not fresh or now_ns < self._next_ns:
            return 0
        self._told += fresh
        self._next_ns = now_ns + _PERIOD_NS
        return fresh

    def close(self) -> None:
        """Give standard output back."""
        os.dup2(self._stdout, _STDOUT)
        os.close(self._stdout)
        self._reader.join(timeout=1.0)

    def _read(self) -> None:
        kept = 0
        for line in self._lines():
            self._heard += REFUSED_BY.encode() in line
            if kept < _KEPT_LINES:
                kept += 1
                _log.warning("%s", line.decode(errors="replace"))
        os.close(self._source)

    def _lines(self) -> Iterator[bytes]:
        rest = b""
        while data := os.read(self._source, 65536):
            *lines, rest = (rest + data).split(b"\n")
            yield from lines
