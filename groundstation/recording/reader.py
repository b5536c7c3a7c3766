"""Reads recordings, whole or cut anywhere: what was flushed before a crash is there, the rest is named as damage."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from itertools import count
from pathlib import Path
from typing import IO

import msgspec
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Metadata
from mcap.writer import MCAP0_MAGIC

from groundstation.bus import codec
from groundstation.bus.keys import Key
from groundstation.bus.messages import Header, Message
from groundstation.bus.topics import Topic
from groundstation.errors import GroundStationError, MessageError
from groundstation.recording.chunks import RawRecord, chunk_data, chunk_records, frames
from groundstation.recording.series import part_path

__all__ = [
    "RawRecord",
    "Record",
    "Recording",
    "RecordingError",
    "decode",
    "open_recording",
    "parts",
    "payload",
]


class RecordingError(GroundStationError):
    """The file is missing or no recording at all; damage inside a recording is never an error."""


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
            for opcode, body in frames(stream, self.damage):
                if opcode == Opcode.CHUNK:
                    data = chunk_data(body, self.damage)
                    yield from chunk_records(data, channels, wanted, self.damage)

    def records(self, wanted: Callable[[Topic], bool] = lambda _topic: True) -> Iterator[Record]:
        """Yield decoded messages of the wanted typed topics; what does not decode is named in `damage`."""
        for raw in self.raw_records(lambda topic: topic.type is not None and wanted(topic)):
            try:
                yield decode(raw)
            except MessageError as error:
                self.damage.append(str(error))


def decode(raw: RawRecord) -> Record:
    """Return the message of a typed topic; raises MessageError when its bytes do not fit."""
    return Record(raw.key.topic, raw.key, raw.log_time_ns, codec.decode(raw.key, raw.data))


class _Wrapped(msgspec.Struct):
    header: Header
    data: bytes


_wrapped = msgspec.json.Decoder(_Wrapped)


def payload(raw: RawRecord) -> tuple[Header, bytes]:
    """Return header and bytes of an untyped topic exactly as they were on the bus: a picture, or framed datagrams.

    Raises MessageError when the record does not fit.
    """
    try:
        wrapped = _wrapped.decode(raw.data)
    except (msgspec.DecodeError, ValueError, RecursionError) as error:
        raise MessageError("malformed", f"{raw.key}: {error}") from error
    return wrapped.header, wrapped.data


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
    for opcode, body in frames(stream, []):
        source = ReadDataStream(BytesIO(body))
        if opcode == Opcode.ATTACHMENT:
            attachment = Attachment.read(source)
            recording.attachments[attachment.name] = attachment.data
        elif opcode == Opcode.METADATA:
            metadata = Metadata.read(source)
            recording.metadata[metadata.name] = metadata.metadata
        elif opcode == Opcode.CHUNK:
            return
