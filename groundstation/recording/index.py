"""Indexes a file by time and channel, in one pass that decompresses hardly anything."""

import re
import struct
from bisect import bisect_left
from collections import Counter
from dataclasses import dataclass, field
from itertools import accumulate
from pathlib import Path
from typing import IO

from mcap.opcode import Opcode
from mcap.records import Channel, Schema
from mcap.writer import MCAP0_MAGIC

from groundstation.bus.keys import Key
from groundstation.recording.chunks import (
    RECORD,
    Channels,
    RawRecord,
    Wanted,
    chunk_data,
    chunk_records,
    count_messages,
    declarations,
    every_topic,
    is_record,
    skip_damage,
)

# WIRE (MCAP specification, records Chunk and Message Index): the fixed fields at their head.
_CHUNK_HEAD = struct.Struct("<QQ")
_INDEX_HEAD = struct.Struct("<HI")
_INDEX_ENTRY_BYTES = 16
# Large enough for the message indexes after a chunk, small beside the chunk that is skipped.
_BUFFER_BYTES = 1 << 14


@dataclass(slots=True)
class Chunk:
    """One chunk: where its record begins, how long its body is, its times [UNIX ns], messages per channel id."""

    offset: int
    length: int
    start_ns: int
    end_ns: int
    counts: dict[int, int] = field(default_factory=dict)


class FileIndex:
    """The chunks and channels of one file, whole or cut anywhere; `damage` names its faults.

    chunks: in file order, which is the order in which their messages arrived.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.damage: list[str] = []
        self.channels: Channels = {}
        self.declared: dict[int, Channel] = {}
        self.schemas: dict[int, Schema] = {}
        self.chunks: list[Chunk] = []
        with path.open("rb", buffering=_BUFFER_BYTES) as stream:
            self._scan(stream, path.stat().st_size)
            self._complete(stream)
        self.chunks = [chunk for chunk in self.chunks if chunk.counts]
        self._by_time = sorted(self.chunks, key=lambda chunk: chunk.start_ns)
        self._starts_ns = [chunk.start_ns for chunk in self._by_time]
        # Chunks overlap slightly in time: the latest time of all chunks up to each.
        self._reach_ns = list(accumulate((chunk.end_ns for chunk in self._by_time), max))
        self._places: dict[int, list[int]] = {}
        for number, chunk in enumerate(self._by_time):
            for id_ in chunk.counts:
                self._places.setdefault(id_, []).append(number)

    def _scan(self, stream: IO[bytes], size: int) -> None:
        at = len(MCAP0_MAGIC)
        while True:
            stream.seek(at)
            head = stream.read(RECORD.size)
            opcode, length = RECORD.unpack(head) if len(head) == RECORD.size else (0, size)
            if at + RECORD.size + length > size or not is_record(opcode):
                if not skip_damage(stream, at, self.damage):
                    return
                at = stream.tell()
                continue
            if opcode == Opcode.CHUNK and length >= _CHUNK_HEAD.size:
                self.chunks.append(Chunk(at, length, *_CHUNK_HEAD.unpack(stream.read(_CHUNK_HEAD.size))))
            elif opcode == Opcode.MESSAGE_INDEX and self.chunks and length >= _INDEX_HEAD.size:
                channel, span = _INDEX_HEAD.unpack(stream.read(_INDEX_HEAD.size))
                if span:
                    self.chunks[-1].counts[channel] = span // _INDEX_ENTRY_BYTES
            elif opcode in (Opcode.FOOTER, Opcode.DATA_END):
                return
            at += RECORD.size + length

    def _complete(self, stream: IO[bytes]) -> None:
        """Learn the channels, which are in the chunk that first uses them, and count messages without an index."""
        for chunk in self.chunks:
            counted = chunk.counts and not (self.damage and chunk is self.chunks[-1])
            if not counted or any(channel not in self.declared for channel in chunk.counts):
                data = self._data(stream, chunk, [] if counted else self.damage)
                channels, schemas = declarations(data)
                self.declared |= channels
                self.schemas |= schemas
                for _ in chunk_records(data, self.channels, every_topic, self.damage):
                    pass
                if not counted:
                    chunk.counts = dict(count_messages(data))

    def _data(self, stream: IO[bytes], chunk: Chunk, damage: list[str]) -> bytes:
        stream.seek(chunk.offset + RECORD.size)
        return chunk_data(stream.read(chunk.length), damage)

    @property
    def stem(self) -> str:
        """Return the common name of all parts of this file."""
        return re.sub(r"-[0-9]+$", "", self.path.stem)

    def data(self, chunk: Chunk) -> bytes:
        """Return the records of a chunk, or nothing if it is damaged, which is noted once."""
        noted: list[str] = []
        with self.path.open("rb") as stream:
            data = self._data(stream, chunk, noted)
        for text in noted:
            self._note(f"{text} at byte {chunk.offset}")
        return data

    def checked_damage(self) -> list[str]:
        """Return the damage after comparing every chunk's checksum."""
        for chunk in self.chunks:
            self.data(chunk)
        return self.damage

    def read(self, chunk: Chunk, wanted: Wanted = every_topic) -> list[RawRecord]:
        """Return the messages of the wanted topics in one chunk, in file order.

        A damaged chunk is noted and skipped.
        """
        channels = {id_: key for id_, key in self.channels.items() if key is None or wanted(key.topic)}
        hidden: Channels = {id_: None for id_ in self.channels if id_ not in channels}
        records = list(chunk_records(self.data(chunk), channels | hidden, wanted, self.damage))
        if any(not chunk.start_ns <= record.log_time_ns <= chunk.end_ns for record in records):
            self._note(f"wrong times, what follows may be out of order, at byte {chunk.offset}")
        return records

    def _note(self, damage: str) -> None:
        if damage not in self.damage:
            self.damage.append(damage)

    def latest(self, time_ns: int, wanted: Wanted) -> dict[Key, RawRecord]:
        """Return for each key of a wanted topic its last message with log time < time."""
        found: dict[Key, RawRecord] = {}
        seen: dict[int, dict[Key, RawRecord]] = {}
        begun = bisect_left(self._starts_ns, time_ns)
        for id_, key in self.channels.items():
            if key is None or not wanted(key.topic):
                continue
            places = self._places.get(id_, [])
            for number in reversed(places[: bisect_left(places, begun)]):
                best = found.get(key)
                if best is not None and self._reach_ns[number] <= best.log_time_ns:
                    break
                if number not in seen:
                    seen[number] = self._last_of(self._by_time[number], time_ns, wanted)
                record = seen[number].get(key)
                if record is not None and (best is None or best.log_time_ns < record.log_time_ns):
                    found[key] = record
        return found

    def _last_of(self, chunk: Chunk, time_ns: int, wanted: Wanted) -> dict[Key, RawRecord]:
        last: dict[Key, RawRecord] = {}
        for record in self.read(chunk, wanted):
            before = last.get(record.key)
            if record.log_time_ns < time_ns and (before is None or before.log_time_ns <= record.log_time_ns):
                last[record.key] = record
        return last

    def holds(self, chunk: Chunk, wanted: Wanted) -> bool:
        """Return whether a chunk has messages of wanted topics."""
        return any((key := self.channels.get(id_)) is not None and wanted(key.topic) for id_ in chunk.counts)

    def counts(self) -> dict[Key, int]:
        """Return the number of messages of each key."""
        total: Counter[Key] = Counter()
        for chunk in self.chunks:
            for id_, count in chunk.counts.items():
                key = self.channels.get(id_)
                if key is not None:
                    total[key] += count
        return dict(total)
