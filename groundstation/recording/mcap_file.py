"""One MCAP file: a channel per key, schemas from the messages themselves, chunks closed at every flush."""

import errno
import os
from contextlib import suppress
from pathlib import Path

from mcap.writer import CompressionType, IndexType, Writer

from groundstation.recording.capture import Entry
from groundstation.recording.compatibility import PROFILE
from groundstation.recording.packed_index import pack_indices
from groundstation.recording.preamble import Preamble
from groundstation.recording.schemas import Description

_CHUNK_BYTES = 1 << 20


class McapFile:
    """Writes one new file. Any method may raise OSError (disk full); the file is then to be abandoned.

    Raises FileExistsError where something is there already, and leaves that alone.
    """

    def __init__(self, path: Path, preamble: Preamble) -> None:
        self.path = path
        self._stream = path.open("xb")
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
        write_preamble(self._writer, preamble)
        self.flush()

    def write(self, entry: Entry) -> None:
        """Add a message; its channel is made when the key is first seen."""
        channel = self._channels.get(entry.channel) or self._add_channel(entry)
        self._writer.add_message(channel, entry.log_time_ns, entry.data, entry.publish_time_ns, entry.sequence)

    def _add_channel(self, entry: Entry) -> int:
        described = entry.description
        channel = self._writer.register_channel(
            entry.channel, described.message_encoding, self._schema(described), entry.facts
        )
        self._channels[entry.channel] = channel
        return channel

    def _schema(self, described: Description) -> int:
        name = described.schema_name
        if name not in self._schemas:
            self._schemas[name] = self._writer.register_schema(name, described.schema_encoding, described.schema)
        return self._schemas[name]

    @property
    def size(self) -> int:
        """Return the number of bytes safe on the disk, as of the last flush."""
        return self._sound_bytes

    def flush(self) -> None:
        """Close the chunk and pass everything to the kernel: it then survives a kill -9.

        A removed file is an error: the kernel would accept everything, and nothing would be left.
        """
        self._writer.flush()
        pack_indices(self._writer)
        self._sound_bytes = self._stream.tell()
        if os.fstat(self._stream.fileno()).st_nlink == 0:
            raise OSError(errno.ENOENT, "the file was removed")

    def close(self) -> None:
        """Write indexes and footer and close; idempotent."""
        if not self._stream.closed:
            self._writer.finish()
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


def write_preamble(writer: Writer, preamble: Preamble) -> None:
    """Write the metadata records and attachments before the first message."""
    for name, entries in preamble.metadata.items():
        writer.add_metadata(name, dict(entries))
    created = preamble.created_unix_ns
    for name, (media_type, data) in preamble.attachments.items():
        writer.add_attachment(created, created, name, media_type, data)
