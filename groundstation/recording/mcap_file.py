"""One MCAP file: a channel per key, schemas from the messages themselves, chunks closed at every flush."""

import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from mcap.writer import CompressionType, IndexType, Writer

from groundstation.bus.topics import Topic
from groundstation.recording.capture import Entry
from groundstation.recording.schemas import ENCODING, recorded_type, schema_name, viewer_schema

PROFILE = "skein"
MESSAGE_ENCODING = "json"
_CHUNK_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class Preamble:
    """What stands at the head of every file of a run: metadata records, and attachments as (media type, bytes)."""

    metadata: Mapping[str, Mapping[str, str]]
    attachments: Mapping[str, tuple[str, bytes]]
    created_unix_ns: int


class McapFile:
    """Writes one file. Any method may raise OSError (disk full); the file is then to be abandoned."""

    def __init__(self, path: Path, preamble: Preamble) -> None:
        self.path = path
        self._stream = path.open("wb")
        # CRCs of the chunks let the reader tell a damaged chunk from a sound one.
        self._writer = Writer(
            self._stream, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD, index_types=IndexType.ALL
        )
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._sound_bytes = 0
        try:
            self._begin(preamble)
        except OSError:
            self.abandon()
            raise

    def _begin(self, preamble: Preamble) -> None:
        self._writer.start(profile=PROFILE, library="skein")
        for name, entries in preamble.metadata.items():
            self._writer.add_metadata(name, dict(entries))
        created = preamble.created_unix_ns
        for name, (media_type, data) in preamble.attachments.items():
            self._writer.add_attachment(created, created, name, media_type, data)
        self.flush()

    def write(self, entry: Entry) -> None:
        """Add a message; its channel is made when the key is first seen."""
        channel = self._channels.get(entry.channel) or self._add_channel(entry)
        self._writer.add_message(channel, entry.log_time_ns, entry.data, entry.publish_time_ns, entry.sequence)

    def _add_channel(self, entry: Entry) -> int:
        key = entry.key
        facts = {"site": key.site, "entity": key.entity, "topic": key.topic.name, "source": key.source}
        channel = self._writer.register_channel(
            entry.channel, MESSAGE_ENCODING, self._schema(key.topic), facts | {"plane": str(key.topic.plane)}
        )
        self._channels[entry.channel] = channel
        return channel

    def _schema(self, topic: Topic) -> int:
        kind = recorded_type(topic)
        name = schema_name(kind)
        if name not in self._schemas:
            self._schemas[name] = self._writer.register_schema(name, ENCODING, viewer_schema(kind))
        return self._schemas[name]

    def flush(self) -> None:
        """Close the chunk and hand everything to the kernel: what was written so far survives a kill -9."""
        self._writer.flush()  # type: ignore[no-untyped-call]
        self._sound_bytes = self._stream.tell()

    def close(self) -> None:
        """Write indexes and footer and close; idempotent."""
        if not self._stream.closed:
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._stream.close()

    def abandon(self) -> None:
        """Close without a footer after an error, cut back to the last flush; an empty file is removed."""
        with suppress(OSError):
            self._stream.close()
        with suppress(OSError):
            if self._sound_bytes:
                os.truncate(self.path, self._sound_bytes)
            else:
                self.path.unlink()
