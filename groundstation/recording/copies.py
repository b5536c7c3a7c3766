"""Makes valid files from recordings: the sound part of a damaged one, or a stretch of a run."""

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from mcap.opcode import Opcode
from mcap.records import Channel, Schema
from mcap.writer import CompressionType, Writer

from groundstation.recording.chunks import RawRecord, inner_records, message_of
from groundstation.recording.compatibility import PROFILE, RecordingError
from groundstation.recording.file_topics import LATCHED_TOPICS
from groundstation.recording.index import FileIndex
from groundstation.recording.mcap_file import write_preamble
from groundstation.recording.outputs import new_file
from groundstation.recording.preamble import Preamble
from groundstation.recording.reader import Recording, open_recording
from groundstation.recording.run import RecordedRun
from groundstation.recording.stretch import Stretch

_FOR_EVER = 1 << 63
_RECOVERED = "recovered"


@dataclass(frozen=True, slots=True)
class Copied:
    """One message with the channel it came from; times in UNIX ns."""

    channel: Channel
    schema: Schema | None
    sequence: int
    log_time_ns: int
    publish_time_ns: int
    data: bytes


def messages_of(index: FileIndex, from_ns: int = 0, until_ns: int = _FOR_EVER) -> Iterator[Copied]:
    """Yield all sound messages of a file with from <= log time < until, viewer channels included, in file order."""
    for chunk in index.chunks:
        if chunk.end_ns < from_ns or chunk.start_ns >= until_ns:
            continue
        data = index.data(chunk)
        for opcode, begin, end in inner_records(data):
            if opcode != Opcode.MESSAGE:
                continue
            number, sequence, logged, published, payload = message_of(data, begin, end)
            channel = index.declared.get(number)
            if channel is not None and from_ns <= logged < until_ns:  # else it was declared in a damaged chunk
                yield Copied(channel, index.schemas.get(channel.schema_id), sequence, logged, published, payload)


class CopyWriter:
    """Writes messages of recordings to a new one: `with new_copy(path, preamble) as writer`."""

    def __init__(self, stream: IO[bytes], preamble: Preamble) -> None:
        self._writer = Writer(stream, compression=CompressionType.ZSTD)
        self._channels: dict[str, int] = {}
        self._schemas: dict[tuple[str, bytes], int] = {}
        self.written = 0
        self._writer.start(profile=PROFILE, library="skein")
        write_preamble(self._writer, preamble)

    def write(self, message: Copied) -> None:
        """Add a message under its channel's name, with the schema it was recorded with."""
        channel = self._channels.get(message.channel.topic) or self._add_channel(message)
        self._writer.add_message(channel, message.log_time_ns, message.data, message.publish_time_ns, message.sequence)
        self.written += 1

    def _add_channel(self, message: Copied) -> int:
        channel, schema = message.channel, message.schema
        number = 0
        if schema is not None:
            known = (schema.name, schema.data)
            if known not in self._schemas:
                self._schemas[known] = self._writer.register_schema(schema.name, schema.encoding, schema.data)
            number = self._schemas[known]
        added = self._writer.register_channel(channel.topic, channel.message_encoding, number, channel.metadata)
        self._channels[channel.topic] = added
        return added

    def finish(self) -> None:
        """Write the indexes."""
        self._writer.finish()


@contextmanager
def new_copy(path: Path, preamble: Preamble) -> Iterator[CopyWriter]:
    """Yield a writer whose file appears at the path only when it is complete.

    Raises OperatorMistake when something is there already or nothing can be, OutputError when the disk refuses.
    """
    with new_file(path) as partial, partial.open("wb") as stream:
        writer = CopyWriter(stream, preamble)
        yield writer
        writer.finish()


def recover(path: Path, target: Path) -> tuple[int, list[str]]:
    """Write all sound messages of a file into a new one, with a note of the damage; returns their number and it.

    Raises RecordingError if the file is not ours, or not a single message is left.
    """
    opened, index = open_recording(path), FileIndex(path)
    damage = [*opened.preamble_damage, *index.checked_damage()]
    note = {_RECOVERED: {"damage": "; ".join([*damage_before(opened.metadata), *damage])}}
    with new_copy(target, preamble_copy(opened, note)) as writer:
        for message in messages_of(index):
            writer.write(message)
        if not writer.written:
            raise RecordingError(
                f"{path}: nothing can be recovered: {'; '.join(index.damage) or 'it holds no messages'}"
            )
    return writer.written, damage


def damage_before(metadata: Mapping[str, Mapping[str, str]]) -> list[str]:
    """Return in one text the damage of the file that a recording was recovered from; nothing for any other."""
    noted = metadata.get(_RECOVERED, {}).get("damage")
    return [noted] if noted else []


def cut(run: RecordedRun, stem: str, from_ns: int, until_ns: int, target: Path) -> int:
    """Write the messages with from <= log time < until of one stem's parts into a new file; returns their number.

    It begins with the latched values: the last messages before `from`, logged at `from` with their own publish time.
    """
    indexes = [index for index in run.indexes if index.stem == stem]
    latched = run.latest_before(from_ns, LATCHED_TOPICS.__contains__)
    opened = open_recording(indexes[0].path)
    with new_copy(target, preamble_copy(opened, Stretch(from_ns, until_ns).as_metadata())) as writer:
        for message in _latched_copies(indexes, latched.values(), from_ns):
            writer.write(message)
        for index in indexes:
            for message in messages_of(index, from_ns, until_ns):
                writer.write(message)
    return writer.written


def preamble_copy(opened: Recording, note: Mapping[str, Mapping[str, str]]) -> Preamble:
    """Return the preamble of a recording for a copy of it, with a note about the copy."""
    written = opened.metadata.get("run", {}).get("created_unix_ns", "")
    created = int(written) if re.fullmatch("[0-9]{1,19}", written) else 0  # metadata has no checksum
    typed = {name: (opened.media_types[name], data) for name, data in opened.attachments.items()}
    return Preamble({**opened.metadata, **note}, typed, created)


def _latched_copies(indexes: list[FileIndex], latched: Iterable[RawRecord], from_ns: int) -> Iterator[Copied]:
    """Yield the latched values of these files under the channels that they were recorded with."""
    waiting = {str(raw.key): raw for raw in latched}
    for index in indexes:
        for channel in index.declared.values():
            raw = waiting.pop(channel.topic, None)
            if raw is not None:
                schema = index.schemas.get(channel.schema_id)
                yield Copied(channel, schema, raw.sequence, from_ns, raw.publish_time_ns, raw.data)
