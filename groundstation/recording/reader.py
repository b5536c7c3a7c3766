"""Reads recordings, whole or cut anywhere: data flushed before a crash is returned, the rest is named as damage."""

import re
import zlib
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import IO

import msgspec
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Metadata
from mcap.records import Header as FileHeader
from mcap.writer import MCAP0_MAGIC

from groundstation.bus import codec
from groundstation.bus.keys import Key
from groundstation.bus.messages import Header, Message
from groundstation.bus.topics import Topic
from groundstation.errors import MessageError
from groundstation.recording.chunks import UNREADABLE, RawRecord, Wanted, chunk_data, chunk_records, every_topic, frames
from groundstation.recording.compatibility import RecordingError, require_ours, require_readable
from groundstation.recording.file_topics import RAW, STATE, is_picture
from groundstation.recording.foreign import LONGEST, kind_of_content
from groundstation.recording.part_names import numbered_parts
from groundstation.recording.preamble import FIELD_NAME
from groundstation.recording.viewers import picture_parts

__all__ = [
    "RawRecord",
    "Record",
    "Recording",
    "RecordingError",
    "attached_field",
    "decode",
    "open_parts",
    "open_recording",
    "parts",
    "payload",
    "recorded_offset_ns",
]


@dataclass(frozen=True, slots=True)
class Record:
    """One recorded message of a typed topic; log time in UNIX ns."""

    topic: Topic
    key: Key
    log_time_ns: int
    message: Message


@dataclass(slots=True)
class Recording:
    """One file. Iterate with `raw_records` or `records`; then `damage` names its faults.

    attachments and metadata are filled by `open_recording`, as far as they stand before the first message.
    """

    path: Path
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    media_types: dict[str, str] = field(default_factory=dict)
    damage: list[str] = field(default_factory=list)
    preamble_damage: list[str] = field(default_factory=list)

    def raw_records(self, wanted: Wanted = every_topic) -> Iterator[RawRecord]:
        """Yield the messages of the wanted topics in file order; foreign channels are skipped."""
        self.damage[:] = self.preamble_damage
        channels: dict[int, Key | None] = {}
        with self.path.open("rb") as stream:
            for opcode, body in frames(stream, self.damage):
                if opcode == Opcode.CHUNK:
                    data = chunk_data(body, self.damage)
                    yield from chunk_records(data, channels, wanted, self.damage)

    def records(self, wanted: Wanted = every_topic) -> Iterator[Record]:
        """Yield decoded messages of the wanted typed topics; undecodable ones are named in `damage`."""
        for raw in self.raw_records(lambda topic: topic.type is not None and wanted(topic)):
            if (record := self.decoded(raw)) is not None:
                yield record

    def decoded(self, raw: RawRecord) -> Record | None:
        """Return the message of a typed topic; None where its bytes do not fit, which is named in `damage`."""
        try:
            return decode(raw)
        except MessageError as error:
            self.damage.append(str(error))
            return None


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
        if is_picture(raw.key.topic) and not raw.data.startswith(b"{"):  # early recordings hold pictures in JSON
            header, picture = picture_parts(raw.data, raw.key.topic.encoding.startswith("video/"))
            return codec.decode_header(raw.key, header), picture
        wrapped = _wrapped.decode(raw.data)
    except (msgspec.DecodeError, ValueError, RecursionError) as error:
        raise MessageError("malformed", f"{raw.key}: {error}") from error
    return wrapped.header, wrapped.data


def parts(run_dir: Path, stem: str) -> list[Path]:
    """Return the files of one stem in a run folder, in order; removed parts are skipped."""
    return [path for _, path in numbered_parts(run_dir, stem)]


def open_recording(path: Path) -> Recording:
    """Return a recording with its attachments and metadata; raises RecordingError if it is not ours."""
    recording = Recording(path)
    if path.is_fifo():  # it is read more than once; opening one without a writer would wait forever
        raise RecordingError(f"{path}: is a pipe, not a file")
    try:
        with path.open("rb") as stream:
            start = stream.read(len(MCAP0_MAGIC))
            if start != MCAP0_MAGIC:
                raise RecordingError(f"{path}: not an MCAP recording{_instead(start + stream.read(LONGEST))}")
            _read_preamble(stream, recording)
    except OSError as error:
        raise RecordingError(f"{path}: {error.strerror or error}") from error
    require_readable(str(path), recording.metadata)
    return recording


def _instead(start: bytes) -> str:
    what = kind_of_content(start)
    return f": this is {what}" if what else "" if start else " (the file is empty)"


def open_parts(paths: Iterable[Path]) -> tuple[list[Recording], dict[Path, str]]:
    """Return the parts that are recordings, and for each other file why it is none (killed before its first byte).

    Raises the RecordingError of the first of them when none can be read.
    """
    opened: list[Recording] = []
    refused: dict[Path, RecordingError] = {}
    for path in paths:
        try:
            opened.append(open_recording(path))
        except RecordingError as error:
            refused[path] = error
    if refused and not opened:
        raise next(iter(refused.values()))
    return opened, {path: str(error).removeprefix(f"{path}: ") for path, error in refused.items()}


def attached_field(run_dir: Path) -> bytes:
    """Return the resolved field (JSON) that a run is recorded with, or `{}` if no part has it (yet)."""
    try:
        opened, _ = open_parts(parts(run_dir, STATE))
    except RecordingError:
        return b"{}"
    return next((part.attachments[FIELD_NAME] for part in opened if FIELD_NAME in part.attachments), b"{}")


def recorded_offset_ns(run_dir: Path, clock: str) -> int | None:
    """Return UNIX time minus a boot clock [ns] as a run is recorded with it; None if no part has it (yet)."""
    for path in (*parts(run_dir, STATE), *parts(run_dir, RAW)):
        with suppress(RecordingError):  # killed before its first byte
            noted = open_recording(path).metadata.get("run", {})
            written = noted.get("unix_offset_ns", "")
            if noted.get("clock") == clock and re.fullmatch("-?[0-9]{1,19}", written):  # metadata has no checksum
                return int(written)
    return None


def _read_preamble(stream: IO[bytes], recording: Recording) -> None:
    for opcode, body in frames(stream, []):
        if opcode == Opcode.CHUNK:
            return
        try:
            _take(opcode, body, recording)
        except UNREADABLE as error:
            recording.preamble_damage.append(f"unreadable {Opcode(opcode).name.lower()} at its head: {error!r}")


def _take(opcode: int, body: bytes, recording: Recording) -> None:
    source = ReadDataStream(BytesIO(body))
    match opcode:
        case Opcode.HEADER:
            header = FileHeader.read(source)
            require_ours(str(recording.path), header.profile, header.library)
        case Opcode.ATTACHMENT:
            checksum = int.from_bytes(body[-4:], "little")
            if checksum and zlib.crc32(body[:-4]) != checksum:
                raise ValueError("wrong checksum")
            attachment = Attachment.read(source)
            recording.attachments[attachment.name] = attachment.data
            recording.media_types[attachment.name] = attachment.media_type
        case Opcode.METADATA:
            metadata = Metadata.read(source)
            recording.metadata[metadata.name] = metadata.metadata
