"""Records that no program of ours writes, in chunks with a valid checksum: they are named, and the others read."""

import struct
import zlib
from io import BytesIO
from pathlib import Path

import pytest
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Chunk
from mcap.writer import MCAP0_MAGIC
from taped_flight import Flight, fly

from groundstation.cli.main import run
from groundstation.recording.chunks import RECORD, frames
from groundstation.recording.reader import open_recording
from groundstation.report.gather import gather

FAR_NS = 1 << 62
_MESSAGE = struct.Struct("<HIQQ")


def _record(opcode: int, body: bytes) -> bytes:
    return RECORD.pack(opcode, len(body)) + body


def _text(content: bytes) -> bytes:
    return struct.pack("<I", len(content)) + content


SHORT_MESSAGE = _record(Opcode.MESSAGE, b"\1\0\0")
BAD_CHANNEL = _record(Opcode.CHANNEL, struct.pack("<HH", 999, 1) + _text(b"gs/\xff\xfe") + _text(b"json") + _text(b""))
BAD_SCHEMA = _record(Opcode.SCHEMA, struct.pack("<H", 999) + _text(b"\xff") + _text(b"jsonschema") + _text(b""))


def _redated(data: bytes) -> bytes:
    """Return the last message of a chunk's records, with a time in the far future."""
    at = last = 0
    while at < len(data):
        opcode, length = RECORD.unpack_from(data, at)
        last = at if opcode == Opcode.MESSAGE else last
        at += RECORD.size + length
    _, length = RECORD.unpack_from(data, last)
    body = data[last + RECORD.size : last + RECORD.size + length]
    channel, sequence, _, _ = _MESSAGE.unpack_from(body)
    return _record(Opcode.MESSAGE, _MESSAGE.pack(channel, sequence, FAR_NS, FAR_NS) + body[_MESSAGE.size :])


def _repacked(body: bytes, first: bool, extra: bytes) -> bytes:
    chunk = Chunk.read(ReadDataStream(BytesIO(body)))
    data = zstandard.decompress(chunk.data, max_output_size=chunk.uncompressed_size)
    if first:
        data = extra + data if extra else data + _redated(data)
    head = struct.pack("<QQQI", chunk.message_start_time, chunk.message_end_time, len(data), zlib.crc32(data))
    return head + _text(b"") + struct.pack("<Q", len(data)) + data


def _craft(path: Path, extra: bytes) -> None:
    """Put records into the first chunk of a file, or its last message anew with another time."""
    with path.open("rb") as stream:
        found = list(frames(stream, []))
    first = next(n for n, (opcode, _) in enumerate(found) if opcode == Opcode.CHUNK)
    records = [
        (opcode, _repacked(body, n == first, extra) if opcode == Opcode.CHUNK else body)
        for n, (opcode, body) in enumerate(found)
        if opcode != Opcode.MESSAGE_INDEX  # so that an index has to count the messages
    ]
    path.write_bytes(MCAP0_MAGIC + b"".join(_record(opcode, body) for opcode, body in records) + MCAP0_MAGIC)


@pytest.mark.parametrize(
    ("extra", "damage"),
    [
        (SHORT_MESSAGE, "a message record that is too short"),
        (BAD_CHANNEL, "unreadable channel: "),
        (BAD_SCHEMA, ""),
        (b"", "1 messages are dated far from the first"),
    ],
    ids=["short message", "channel's name", "schema's name", "far time"],
)
def test_a_record_that_nobody_writes_costs_itself_only(
    tmp_path: Path, extra: bytes, damage: str, capsys: pytest.CaptureFixture[str]
) -> None:
    fly(tmp_path, Flight())
    path = tmp_path / "state.mcap"
    whole = len(list(open_recording(path).raw_records()))
    end_s = gather(tmp_path).end_s
    _craft(path, extra)
    assert len(list(open_recording(path).raw_records())) == whole + (not extra)
    data = gather(tmp_path)
    assert data.end_s == end_s
    assert [text.startswith(f"state.mcap: {damage}") for text in data.damage] == [True] * bool(damage)
    assert run(["report", str(tmp_path), "--no-plot"]) == 0
    capsys.readouterr()
    assert run(["recording", "info", str(path)]) == 0
    assert (damage in capsys.readouterr().out) == bool(extra)
    assert run(["recording", "recover", str(path), "--output", str(tmp_path / "sound.mcap")]) == 0
