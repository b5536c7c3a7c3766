"""The records inside an MCAP file of ours: framing, chunks and messages, each read as far as it is sound."""

import os
import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from io import BytesIO
from typing import IO

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Schema
from mcap.writer import MCAP0_MAGIC

from groundstation.bus import keys
from groundstation.bus.keys import Key
from groundstation.bus.topics import Topic
from groundstation.errors import MessageError
from groundstation.recording.viewers import is_for_viewers

RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
# We write nothing longer; a longer length field is damage, no reason to reserve memory.
_MAX_RECORD_BYTES = 1 << 30
_MAX_CHUNK_BYTES = 1 << 28
# WIRE (MCAP specification): a chunk's record from its opcode to the length of its records, compressed as ours are.
_CHUNK = struct.Struct("<BQQQQII4sQ")
_MARK, _MARK_AT = struct.pack("<I4s", 4, b"zstd"), struct.calcsize("<BQQQQI")
_BLOCK_BYTES = 1 << 20
# The errors that a parser raises for a damaged record body; OverflowError: a length of more than 63 bits.
UNREADABLE = (ValueError, EOFError, OverflowError, struct.error, zstandard.ZstdError, McapError)

Channels = dict[int, Key | None]
Wanted = Callable[[Topic], bool]


def every_topic(_topic: Topic) -> bool:
    """Accept every topic."""
    return True


def among(topics: Iterable[Topic]) -> Wanted:
    """Return a filter for topics; by identity, because there is one object for each and every message is tested."""
    known = frozenset(map(id, topics))
    return lambda topic: id(topic) in known


@dataclass(frozen=True, slots=True)
class RawRecord:
    """One recorded message, undecoded; times in UNIX ns."""

    key: Key
    log_time_ns: int
    publish_time_ns: int
    sequence: int
    data: bytes


def frames(stream: IO[bytes], damage: list[str]) -> Iterator[tuple[int, bytes]]:
    """Yield whole records as (opcode, body) until the footer, or until the file ends early.

    After an invalid record it continues with the next whole chunk.
    """
    stream.seek(len(MCAP0_MAGIC))
    while True:
        at = stream.tell()
        head = stream.read(RECORD.size)
        opcode, length = RECORD.unpack(head) if len(head) == RECORD.size else (0, _MAX_RECORD_BYTES + 1)
        body = stream.read(length) if length <= _MAX_RECORD_BYTES else b""
        if len(body) < length or not is_record(opcode):
            if not skip_damage(stream, at, damage):
                return
            continue
        yield opcode, body
        if opcode == Opcode.FOOTER:
            return


def is_record(opcode: int) -> bool:
    """Return whether an opcode stands for a record that a file of ours may hold."""
    return Opcode.HEADER <= opcode <= Opcode.DATA_END


def skip_damage(stream: IO[bytes], at: int, damage: list[str]) -> bool:
    """Go to the next whole chunk after an invalid record, and note the loss; False: nothing follows."""
    found = _next_chunk(stream, at + 1)
    damage.append(f"cut off at byte {at}" if found is None else f"unreadable from byte {at} to {found}")
    if found is not None:
        stream.seek(found)
    return found is not None


def _next_chunk(stream: IO[bytes], after: int) -> int | None:
    size = stream.seek(0, os.SEEK_END)
    for start in range(after, size, _BLOCK_BYTES):
        stream.seek(start)
        block = stream.read(_BLOCK_BYTES + len(_MARK) - 1)
        found = block.find(_MARK)
        while found >= 0:
            begin = start + found - _MARK_AT
            if begin >= after and _is_chunk(stream, begin, size):
                return begin
            found = block.find(_MARK, found + 1)
    return None


def _is_chunk(stream: IO[bytes], begin: int, size: int) -> bool:
    stream.seek(begin)
    head = stream.read(_CHUNK.size)
    if len(head) < _CHUNK.size:
        return False
    opcode, length, *_, records = _CHUNK.unpack(head)
    body = _CHUNK.size - RECORD.size + records
    return bool(opcode == Opcode.CHUNK and length == body and begin + RECORD.size + length <= size)


def chunk_data(body: bytes, damage: list[str]) -> bytes:
    """Return the uncompressed records of a chunk, or nothing if it is damaged."""
    try:
        chunk = Chunk.read(ReadDataStream(BytesIO(body)))
        if chunk.uncompressed_size > _MAX_CHUNK_BYTES:
            raise ValueError(f"{chunk.uncompressed_size} bytes")
        data = chunk.data
        if chunk.compression == "zstd":
            data = _decompressed(chunk)
        elif chunk.compression:
            raise ValueError(f"compression {chunk.compression}")
        if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
            raise ValueError("wrong checksum")
    except UNREADABLE as error:
        damage.append(f"damaged chunk: {error}")
        return b""
    return bytes(data)


def _decompressed(chunk: Chunk) -> bytes:
    # A size in the frame's own head is reserved as it stands, whatever `max_output_size` says.
    if zstandard.frame_content_size(chunk.data) > chunk.uncompressed_size:
        raise ValueError("its frame is longer than the chunk")
    return bytes(zstandard.decompress(chunk.data, max_output_size=chunk.uncompressed_size))


def inner_records(data: bytes, damage: list[str] | None = None) -> Iterator[tuple[int, int, int]]:
    """Yield (opcode, begin, end of the body) of the records in a chunk's data, up to the first that is cut short.

    A message too short to be one is noted and left out.
    """
    at, size = 0, len(data)
    while at + RECORD.size <= size:
        opcode, length = RECORD.unpack_from(data, at)
        begin = at + RECORD.size
        at = begin + length
        if at > size:
            return
        if opcode == Opcode.MESSAGE and length < _MESSAGE.size:
            _note(damage, "a message record that is too short")
            continue
        yield opcode, begin, at


def _note(damage: list[str] | None, text: str) -> None:
    if damage is not None and text not in damage:
        damage.append(text)


def message_of(data: bytes, begin: int, end: int) -> tuple[int, int, int, int, bytes]:
    """Return (channel id, sequence, log time, publish time, payload) of a message record."""
    return (*_MESSAGE.unpack_from(data, begin), data[begin + _MESSAGE.size : end])


def chunk_records(data: bytes, channels: Channels, wanted: Wanted, damage: list[str]) -> Iterator[RawRecord]:
    """Yield the messages of a chunk whose channel leads to a key; adds the chunk's declarations to `channels`."""
    for opcode, begin, end in inner_records(data, damage):
        if opcode == Opcode.MESSAGE:
            channel, sequence, logged, published = _MESSAGE.unpack_from(data, begin)
            key = channels.get(channel)
            if key is not None:
                yield RawRecord(key, logged, published, sequence, data[begin + _MESSAGE.size : end])
        elif opcode == Opcode.CHANNEL:
            _learn_channel(data[begin:end], channels, wanted, damage)


def count_messages(data: bytes) -> Counter[int]:
    """Return how many messages of each channel id a chunk holds."""
    return Counter(
        _MESSAGE.unpack_from(data, begin)[0] for opcode, begin, _ in inner_records(data) if opcode == Opcode.MESSAGE
    )


def declarations(data: bytes) -> tuple[dict[int, Channel], dict[int, Schema]]:
    """Return the channels and schemas that a chunk declares, by id; `chunk_records` notes channels that are damaged."""
    channels: dict[int, Channel] = {}
    schemas: dict[int, Schema] = {}
    for opcode, begin, end in inner_records(data):
        with suppress(*UNREADABLE):
            if opcode == Opcode.CHANNEL:
                channel = Channel.read(ReadDataStream(BytesIO(data[begin:end])))
                channels[channel.id] = channel
            elif opcode == Opcode.SCHEMA:
                schema = Schema.read(ReadDataStream(BytesIO(data[begin:end])))
                schemas[schema.id] = schema
    return channels, schemas


def _learn_channel(body: bytes, channels: Channels, wanted: Wanted, damage: list[str]) -> None:
    try:
        channel = Channel.read(ReadDataStream(BytesIO(body)))
    except UNREADABLE as error:
        _note(damage, f"unreadable channel: {error}")
        return
    if channel.id in channels:
        return
    channels[channel.id] = None
    if is_for_viewers(channel.topic):
        return  # a copy for viewers; the messages themselves are on their own channels
    try:
        key = keys.parse(channel.topic)
    except MessageError:
        damage.append(f"foreign channel {channel.topic}")
        return
    channels[channel.id] = key if wanted(key.topic) else None
