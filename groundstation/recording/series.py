"""A file that never gives up: after a write error it goes on in a new one as soon as there is room for it."""

import errno
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from groundstation.bus.clock import NS_PER_MS, NS_PER_S
from groundstation.recording.capture import Entry
from groundstation.recording.mcap_file import McapFile, Preamble

# With one turn of the recorder (66 ms) on top, a kill -9 costs less than half a second.
FLUSH_PERIOD_NS = 400 * NS_PER_MS
RETRY_PERIOD_NS = 2 * NS_PER_S

Opener = Callable[[Path, Preamble], McapFile]


@dataclass(frozen=True, slots=True)
class Trouble:
    """A failure, or (`recovered`) a new file after one."""

    text: str
    recovered: bool = False


def part_path(folder: Path, stem: str, number: int) -> Path:
    """Return the path of a part: `stem.mcap`, `stem-2.mcap`, ..."""
    return folder / (f"{stem}.mcap" if number == 1 else f"{stem}-{number}.mcap")


class FileSeries:
    """The parts of one recording in a run folder. Never raises; what could not be written is counted in `lost`.

    has_room: asked before a part is begun, so that a full disk is not littered with fragments.
    """

    def __init__(
        self,
        folder: Path,
        stem: str,
        preamble: Preamble,
        opener: Opener = McapFile,
        has_room: Callable[[], bool] = lambda: True,
    ) -> None:
        self._folder = folder
        self._stem = stem
        self._preamble = preamble
        self._opener = opener
        self._has_room = has_room
        self._file: McapFile | None = None
        self._retry_ns = 0
        self._flush_ns = 0
        self._pending = 0
        self._troubles: list[Trouble] = []
        self.failing = False
        self.written = 0
        self.lost = 0

    def write(self, entry: Entry, now_ns: int) -> None:
        """Add an entry, or count it as lost."""
        file = self._file or self._open(now_ns)
        if file is None:
            self.lost += 1
            return
        self._pending += 1
        try:
            file.write(entry)
        except OSError as error:
            self._fail(error, now_ns)

    def tick(self, now_ns: int) -> None:
        """Flush when it is due, reopen when it is time; call it each turn."""
        if self._file is None:
            self._open(now_ns)
        elif now_ns >= self._flush_ns:
            self._flush_ns = now_ns + FLUSH_PERIOD_NS
            self._settle(self._file.flush, now_ns)

    def close(self) -> None:
        """Finish the current part."""
        if self._file is not None:
            self._settle(self._file.close, 0)
            self._file = None

    def take_troubles(self) -> list[Trouble]:
        """Return and forget what happened since the last call."""
        troubles, self._troubles = self._troubles, []
        return troubles

    def _settle(self, step: Callable[[], None], now_ns: int) -> None:
        try:
            step()
        except OSError as error:
            self._fail(error, now_ns)
        else:
            self.written += self._pending
            self._pending = 0

    def _open(self, now_ns: int) -> McapFile | None:
        if now_ns < self._retry_ns:
            return None
        path = next(part for n in count(1) if not (part := part_path(self._folder, self._stem, n)).exists())
        try:
            if not self._has_room():
                raise OSError(errno.ENOSPC, "no space left on the disk")
            self._file = self._opener(path, self._preamble)
        except OSError as error:
            self._fail(error, now_ns)
            return None
        self._flush_ns = now_ns + FLUSH_PERIOD_NS
        if self.failing:
            self.failing = False
            self._troubles.append(Trouble(f"recording goes on in {path.name}; {self.lost} messages are lost", True))
        return self._file

    def _fail(self, error: OSError, now_ns: int) -> None:
        if self._file is not None:
            self._file.abandon()
            self._file = None
        self._retry_ns = now_ns + RETRY_PERIOD_NS
        self.lost += self._pending
        self._pending = 0
        if not self.failing:  # loud once, not at every retry
            self.failing = True
            self._troubles.append(Trouble(f"cannot write the {self._stem} recording: {error.strerror or error}"))
