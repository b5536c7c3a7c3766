"""PaVE frames: a real capture, frames assembled by hand, and damage."""

import random
import struct

import pytest

from drivers.ardrone.wire.pave import FrameReader, FrameType, PaveFrame, encode_frame


def frame(payload, number=7, header_size=64, kind=1):
    head = struct.pack(
        "<4sBBHIHHHHIIBBBB", b"PaVE", 2, 4, header_size, len(payload), 640, 368, 640, 360, number, 1234, 1, 0, kind, 0
    )
    return head.ljust(header_size, b"\0") + payload


@pytest.fixture
def capture(real_data):
    return real_data("ardrone/pave68-node-24971.bin").read_bytes()


def test_real_capture_has_five_h264_frames(capture):
    reader = FrameReader()
    frames = reader.feed(capture)
    assert reader.skipped == 0 and len(frames) >= 4
    assert [f.kind for f in frames].count(FrameType.IDR) == 1
    assert {(f.codec, f.width, f.height) for f in frames} == {(4, 640, 360)}
    assert all(f.payload.startswith(b"\0\0\0\1") for f in frames)
    assert [f.number for f in frames] == sorted(f.number for f in frames)


@pytest.mark.parametrize("size", [64, 68, 76])
def test_the_payload_begins_where_the_header_says(size):
    (found,) = FrameReader().feed(frame(b"\0\0\0\1gpicture", header_size=size))
    assert found == PaveFrame(4, 640, 360, 7, 1234, FrameType.IDR, b"\0\0\0\1gpicture")


def test_frames_come_whole_from_any_cutting():
    stream = b"".join(frame(bytes([i]) * (i * 50), i, kind=3) for i in range(6))
    for step in (1, 7, 64, 1000):
        reader, frames = FrameReader(), []
        for i in range(0, len(stream), step):
            frames += reader.feed(stream[i : i + step])
        assert [f.number for f in frames] == list(range(6)) and reader.skipped == 0


def test_it_finds_the_next_frame_after_damage():
    torn = frame(b"x" * 10, header_size=64).replace(struct.pack("<H", 64), struct.pack("<H", 9), 1)
    reader = FrameReader()
    frames = reader.feed(b"noise Pa" + torn + frame(b"good", 8, kind=99))
    assert [(f.number, f.kind) for f in frames] == [(8, FrameType.UNKNOWN)]
    assert reader.skipped == 8 + len(torn)


def test_random_bytes_neither_raise_nor_pile_up():
    rng, reader = random.Random(3), FrameReader()
    for _ in range(300):
        reader.feed(rng.choice((b"PaVE", b"")) + rng.randbytes(rng.randrange(200)))
    assert len(reader._buffer) < 4_100_000


def test_encoded_frames_have_the_header_of_the_real_drone(capture):
    first = FrameReader().feed(capture)[0]
    assert (first.stream, first.slices, first.slice_index, first.parameter_sizes) == (1, 1, 0, (14, 10))
    position = struct.unpack_from("<Q", capture, 32)[0]
    written = encode_frame(first, position, 68)
    assert written[:52] == capture[:52]
    assert written[68:] == capture[68 : 68 + len(first.payload)]


def test_a_frame_of_damaged_length_does_not_swallow_those_behind_it():
    torn = bytearray(frame(b"x" * 100, 1))
    struct.pack_into("<I", torn, 8, 3_000_000)
    stream = bytes(torn) + frame(b"good", 2) + frame(b"better", 3)
    for step in (1, 50, len(stream)):
        reader, frames = FrameReader(), []
        for i in range(0, len(stream), step):
            frames += reader.feed(stream[i : i + step])
        assert [f.number for f in frames] == [2, 3], step
        assert reader.skipped == len(torn)


def test_nothing_follows_an_advertisement():
    told = bytearray(frame(b"", 1))
    struct.pack_into("<I", told, 8, 9000)
    told[31] = 1
    assert [f.number for f in FrameReader().feed(bytes(told) + frame(b"next", 2))] == [1, 2]
