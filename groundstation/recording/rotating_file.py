"""A file series that survives write errors: it continues in a new file as soon as there is room."""

import errno
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from groundstation.recording.capture import Entry
from groundstation.recording.mcap_file import McapFile
from groundstation.recording.part_names import numbered_parts, part_path
from groundstation.recording.preamble import Preamble
from groundstation.time_units import NS_PER_MS, NS_PER_S

# At every second turn of the recorder (66 ms): a kill -9 costs about the last 0.2 s.
FLUSH_PERIOD_NS = 120 * NS_PER_MS
RETRY_PERIOD_NS = 2 * NS_PER_S

Opener = Callable[[Path, Preamble], McapFile]


@dataclass(frozen=True, slots=True)
class Trouble:
    """A failure, or (`recovered`) a new file after one."""

    text: str
    recovered: bool = False


@dataclass(frozen=True, slots=True)
class Rotation:
    """Limits of a part: size [bytes] and age [ns]; 0: no limit. No part is younger than a second."""

    size_bytes: int = 0
    age_ns: int = 0

    def due(self, size_bytes: int, age_ns: int) -> bool:
        """Return whether a part of that size and age is complete."""
        return age_ns >= NS_PER_S and (0 < self.size_bytes <= size_bytes or 0 < self.age_ns <= age_ns)


NO_ROTATION = Rotation()


class FileSeries:
    """The parts of one recording in a run folder. Never raises; unwritten entries are counted in `lost`.

    has_room: called before a part is begun, so that a full disk is not littered with fragments.
    """

    def __init__(
        self,
        folder: Path,
        stem: str,
        preamble: Preamble,
        opener: Opener = McapFile,
        has_room: Callable[[], bool] = lambda: True,
        rotation: Rotation = NO_ROTATION,
    ) -> None:
        self._folder = folder
        self._stem = stem
        self._preamble = preamble
        self._opener = opener
        self._has_room = has_room
        self._rotation = rotation
        self._begun_ns = 0
        self._file: McapFile | None = None
        self._retry_ns = 0
        self._flush_ns = 0
        self._pending = 0
        self._troubles: list[Trouble] = []
        self._removed = False
        self.failing = False
        self.written = 0
        self.lost = 0

    def write(self, entry: Entry, now_ns: int) -> None:
        """Add an entry, or count it as lost."""
        file = self._file or self._open(now_ns)
        if file is None:
            self.lost += not entry.derived
            return
        self._pending += not entry.derived
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
            self._rotate(now_ns)

    def close(self) -> None:
        """Finish the current part."""
        if self._file is not None:
            self._settle(self._file.close, 0)
            self._file = None

    def take_troubles(self) -> list[Trouble]:
        """Return and forget the troubles since the last call."""
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

    def _rotate(self, now_ns: int) -> None:
        """Begin the next part when this one is full; if that is impossible, continue in this one."""
        full = self._file
        if full is None or not self._rotation.due(full.size, now_ns - self._begun_ns):
            return
        try:
            self._begin(now_ns)
        except OSError:
            self._begun_ns = now_ns  # no second try at every flush; the recorder watches the free disk space
            return
        try:
            full.close()
        except OSError:
            full.abandon()  # everything in it was flushed; only its index is missing

    def _begin(self, now_ns: int) -> McapFile:
        """Open the next part; raises OSError, and leaves the current one as it is, when there is no room."""
        self._folder.mkdir(parents=True, exist_ok=True)  # a person may have removed it
        if not self._has_room():
            raise OSError(errno.ENOSPC, "no space left on the disk")
        self._file = self._next_part()
        self._begun_ns = now_ns
        self._flush_ns = now_ns + FLUSH_PERIOD_NS
        return self._file

    def _next_part(self) -> McapFile:
        number = 1 + max((number for number, _ in numbered_parts(self._folder, self._stem)), default=0)
        while True:
            part = {"part": {"stem": self._stem, "number": str(number)}}
            preamble = replace(self._preamble, metadata={**self._preamble.metadata, **part})
            try:
                return self._opener(part_path(self._folder, self._stem, number), preamble)
            except FileExistsError:  # another recorder began it in this moment
                number += 1

    def _open(self, now_ns: int) -> McapFile | None:
        if now_ns < self._retry_ns:
            return None
        try:
            file = self._begin(now_ns)
        except OSError as error:
            self._fail(error, now_ns)
            return None
        if self.failing:
            self.failing = False
            gone = ", and all that was in the file that was removed" * self._removed
            self._removed = False
            text = f"recording goes on in {file.path.name}; {self.lost} messages are lost{gone}"
            self._troubles.append(Trouble(text, recovered=True))
        return file

    def _fail(self, error: OSError, now_ns: int) -> None:
        if self._file is not None:
            self._removed |= error.errno == errno.ENOENT
            self._file.abandon()
            self._file = None
        self._retry_ns = now_ns + RETRY_PERIOD_NS
        self.lost += self._pending
        self._pending = 0
        if not self.failing:  # reported once, not at every retry
            self.failing = True
            self._troubles.append(Trouble(f"cannot write the {self._stem} recording: {error.strerror or error}"))
