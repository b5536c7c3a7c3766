"""A whole run: all parts of all its files as one time line, with direct access to any time."""

import heapq
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from groundstation.bus.keys import Key
from groundstation.recording.chunks import RawRecord, Wanted, every_topic
from groundstation.recording.file_topics import RAW, STATE
from groundstation.recording.foreign import kind_of_folder
from groundstation.recording.index import Chunk, FileIndex
from groundstation.recording.reader import RecordingError, open_parts, parts
from groundstation.time_units import NS_PER_S


@dataclass(frozen=True, slots=True)
class _Place:
    index: FileIndex
    chunk: Chunk


class RecordedRun:
    """The files of a run by time [UNIX ns]; cut files are read as far as they are sound.

    metadata and attachments are those of the first part that has any. `unread` has the reasons of parts that are no
    recordings at all (killed before the first byte); if none is readable, RecordingError is raised.
    """

    def __init__(self, paths: list[Path]) -> None:
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, bytes] = {}
        self.indexes: list[FileIndex] = []
        readable, self.unread = open_parts(paths)
        for opened in readable:
            self.metadata = self.metadata or opened.metadata
            self.attachments = self.attachments or opened.attachments
            self.indexes.append(FileIndex(opened.path))
            self.indexes[-1].damage[:0] = opened.preamble_damage
        self._places = sorted(
            (_Place(index, chunk) for index in self.indexes for chunk in index.chunks),
            key=lambda place: place.chunk.start_ns,
        )
        self.start_ns = self._places[0].chunk.start_ns if self._places else 0
        self.end_ns = max((place.chunk.end_ns for place in self._places), default=0)

    @property
    def paths(self) -> list[Path]:
        """Return the files, in order."""
        return [index.path for index in self.indexes]

    @property
    def damage(self) -> list[str]:
        """Return the faults found so far, file by file; further reading may find more."""
        unread = [f"{path.name}: {text}" for path, text in self.unread.items()]
        return unread + [f"{index.path.name}: {text}" for index in self.indexes for text in index.damage]

    @property
    def duration_s(self) -> float:
        """Return the time between first and last message."""
        return (self.end_ns - self.start_ns) / NS_PER_S

    def counts(self) -> dict[Key, int]:
        """Return the number of messages of each key in all files."""
        total: dict[Key, int] = {}
        for index in self.indexes:
            for key, count in index.counts().items():
                total[key] = total.get(key, 0) + count
        return total

    def records_from(self, time_ns: int, wanted: Wanted = every_topic) -> Iterator[RawRecord]:
        """Yield messages with time <= log time, in order of log time across all files."""
        waiting: list[tuple[int, int, RawRecord]] = []
        number = 0
        for place in self._places:
            chunk = place.chunk
            if chunk.end_ns < time_ns or not place.index.holds(chunk, wanted):
                continue
            while waiting and waiting[0][0] < chunk.start_ns:
                yield heapq.heappop(waiting)[2]
            for record in place.index.read(chunk, wanted):
                if record.log_time_ns >= time_ns:
                    heapq.heappush(waiting, (record.log_time_ns, number, record))
                    number += 1
        while waiting:
            yield heapq.heappop(waiting)[2]

    def latest_before(self, time_ns: int, wanted: Wanted = every_topic) -> dict[Key, RawRecord]:
        """Return for each wanted key its last message with log time < time: the state at that time."""
        found: dict[Key, RawRecord] = {}
        for index in self.indexes:
            for key, record in index.latest(time_ns, wanted).items():
                if key not in found or found[key].log_time_ns <= record.log_time_ns:
                    found[key] = record
        return found


def open_run(path: Path) -> RecordedRun:
    """Return a run folder (all its parts) or one file; raises RecordingError naming what is wrong with the path."""
    if path.is_dir():
        paths = [part for stem in (STATE, RAW) for part in parts(path, stem)]
        if not paths:
            what = kind_of_folder(path)
            hint = f"this is {what}" if what else "is it a run folder?"
            raise RecordingError(f"{path}: no recording in this folder ({STATE}.mcap is missing); {hint}")
        return RecordedRun(paths)
    return RecordedRun([path])
