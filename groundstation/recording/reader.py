"""Reads recordings, whole or cut anywhere: what was flushed before a crash is there, the rest is named as damage."""

import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from itertools import count
from pathlib import Path
from typing import IO

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Metadata
from mcap.writer import MCAP0_MAGIC

from groundstation.bus import codec, keys
from groundstation.bus.keys import Key
from groundstation.bus.messages import Message
from groundstation.bus.topics import Topic
from groundstation.errors import GroundStationError, MessageError
from groundstation.recording.series import part_path

_RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
# Nothing we write is longer; a longer length field is damage, not a reason to reserve the memory.
_MAX_RECORD_BYTES = 1 << 30
_MAX_CHUNK_BYTES = 1 << 28


class RecordingError(GroundStationError):
    """The file is missing or no recording at all; damage inside a recording is never an error."""


@dataclass(frozen=True, slots=True)
class RawRecord:
    """One recorded message, undecoded; times in UNIX ns."""

    key: Key
    log_time_ns: int
    publish_time_ns: int
    sequence: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Record:
    """One recorded message of a typed topic; log time in UNIX ns."""

    topic: Topic
    key: Key
    log_time_ns: int
    message: Message


@dataclass(slots=True)
class Recording:
    """One file. Iterate with `raw_records` or `records`; then `damage` says what was wrong with it.

    attachments and metadata are filled by `open_recording`, as far as they stand before the first message.
    """

    path: Path
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    damage: list[str] = field(default_factory=list)

    def raw_records(self, wanted: Callable[[Topic], bool] = lambda _topic: True) -> Iterator[RawRecord]:
        """Yield the messages of the wanted topics in file order; foreign channels are passed over."""
        self.damage.clear()
        channels: dict[int, Key | None] = {}
        with self.path.open("rb") as stream:
            for opcode, body in _frames(stream, self.damage):
                if opcode == Opcode.CHUNK:
                    data = _chunk_data(body, self.damage)
                    yield from _chunk_records(data, channels, wanted, self.damage)

    def records(self, wanted: Callable[[Topic], bool] = lambda _topic: True) -> Iterator[Record]:
        """Yield decoded messages of the wanted typed topics; what does not decode is named in `damage`."""
        for raw in self.raw_records(lambda topic: topic.type is not None and wanted(topic)):
            try:
                yield Record(raw.key.topic, raw.key, raw.log_time_ns, codec.decode(raw.key, raw.data))
            except MessageError as error:
                self.damage.append(str(error))


def parts(run_dir: Path, stem: str) -> list[Path]:
    """Return the files of one stem in a run folder, in order."""
    found: list[Path] = []
    for number in count(1):
        path = part_path(run_dir, stem, number)
        if not path.exists():
            return found
        found.append(path)
    raise AssertionError("count() never ends")


def open_recording(path: Path) -> Recording:
    """Return a recording with its attachments and metadata; raises RecordingError if it is none."""
    recording = Recording(path)
    try:
        with path.open("rb") as stream:
            if stream.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
                raise RecordingError(f"{path}: not an MCAP recording")
            stream.seek(0)
            _read_preamble(stream, recording)
    except OSError as error:
        raise RecordingError(f"{path}: {error.strerror or error}") from error
    return recording


def _read_preamble(stream: IO[bytes], recording: Recording) -> None:
    for opcode, body in _frames(stream, []):
        source = ReadDataStream(BytesIO(body))
        if opcode == Opcode.ATTACHMENT:
            attachment = Attachment.read(source)
            recording.attachments[attachment.name] = attachment.data
        elif opcode == Opcode.METADATA:
            metadata = Metadata.read(source)
            recording.metadata[metadata.name] = metadata.metadata
        elif opcode == Opcode.CHUNK:
            return


def _frames(stream: IO[bytes], damage: list[str]) -> Iterator[tuple[int, bytes]]:
    """Yield whole records as (opcode, body) until the footer, or until the file ends early."""
    stream.seek(len(MCAP0_MAGIC))
    while True:
        at = stream.tell()
        head = stream.read(_RECORD.size)
        opcode, length = _RECORD.unpack(head) if len(head) == _RECORD.size else (0, _MAX_RECORD_BYTES + 1)
        body = stream.read(length) if length <= _MAX_RECORD_BYTES else b""
        if len(body) < length:
            damage.append(f"cut off at byte {at}" if at or head else "empty")
            return
        yield opcode, body
        if opcode == Opcode.FOOTER:
            return


def _chunk_data(body: bytes, damage: list[str]) -> bytes:
    """Return the uncompressed records of a chunk, or nothing if it is damaged."""
    try:
        chunk = Chunk.read(ReadDataStream(BytesIO(body)))
        if chunk.uncompressed_size > _MAX_CHUNK_BYTES:
            raise ValueError(f"{chunk.uncompressed_size} bytes")
        data = chunk.data
        if chunk.compression == "zstd":
            data = zstandard.decompress(chunk.data, max_output_size=chunk.uncompressed_size)
        elif chunk.compression:
            raise ValueError(f"compression {chunk.compression}")
        if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
            raise ValueError("wrong checksum")
    except (ValueError, EOFError, struct.error, zstandard.ZstdError) as error:
        damage.append(f"damaged chunk: {error}")
        return b""
    return bytes(data)


def _chunk_records(
    data: bytes, channels: dict[int, Key | None], wanted: Callable[[Topic], bool], damage: list[str]
) -> Iterator[RawRecord]:
    at = 0
    while at + _RECORD.size <= len(data):
        opcode, length = _RECORD.unpack_from(data, at)
        at += _RECORD.size
        if opcode == Opcode.MESSAGE:
            channel, sequence, logged, published = _MESSAGE.unpack_from(data, at)
            key = channels.get(channel)
            if key is not None:
                yield RawRecord(key, logged, published, sequence, data[at + _MESSAGE.size : at + length])
        elif opcode == Opcode.CHANNEL:
            _learn_channel(data[at : at + length], channels, wanted, damage)
        at += length


def _learn_channel(
    body: bytes, channels: dict[int, Key | None], wanted: Callable[[Topic], bool], damage: list[str]
) -> None:
    channel = Channel.read(ReadDataStream(BytesIO(body)))
    if channel.id in channels:
        return
    try:
        key = keys.parse(channel.topic)
    except MessageError:
        channels[channel.id] = None
        damage.append(f"foreign channel {channel.topic}")
        return
    channels[channel.id] = key if wanted(key.topic) else None
