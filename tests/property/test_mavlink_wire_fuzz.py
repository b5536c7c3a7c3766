"""The MAVLink decoder counts arbitrary bytes as refused, and finds no frame where there is none."""

import random
from collections import Counter
from contextlib import suppress

import pytest
from fuzzed_wire import MESSAGES
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as widest

from drivers.mavlink.links.stream_cutter import StreamCutter
from drivers.mavlink.wire import flight
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.frames import FrameDecoder, FrameEncoder, split
from drivers.mavlink.wire.verification import Signing

FLOATS = st.floats(width=32, allow_nan=False, allow_infinity=False)


@settings(max_examples=50, deadline=None)
@given(st.binary(max_size=600))
def test_any_bytes(data):
    cutter = StreamCutter()
    for raw in cutter.feed(data):
        with suppress(WireError):
            FrameDecoder().decode(raw)
    with suppress(WireError):
        for raw in split(data):
            FrameDecoder().decode(raw)


@settings(max_examples=50, deadline=None)
@given(st.tuples(*[FLOATS] * 11), st.integers(0, 2**32 - 1), st.integers(0, 65535))
def test_round_trip_of_a_setpoint(numbers, time_ms, mask):
    message = flight.SetPositionTargetLocalNed(time_ms, 3, 1, 8, mask, *numbers)
    assert FrameDecoder().decode(FrameEncoder(9, 1).encode(message)).message == message


def noise(size: int, seed: int) -> bytes:
    """Random bytes in which about every 20th begins a possible frame: only a start, a length, a kind."""
    rng, known, data = random.Random(seed), sorted(widest.mavlink_map), bytearray()
    while len(data) < size:
        data += rng.randbytes(rng.randrange(30))
        number = rng.choice(known) if rng.random() < 0.8 else rng.randrange(1 << 24)
        start, length = rng.choice((0xFD, 0xFD, 0xFE)), rng.randrange(40)
        data += bytes((start, length, rng.choice((0, 0, 0, 1)), 0, *rng.randbytes(3))) + number.to_bytes(3, "little")
        data += rng.randbytes(length + 2)
    return bytes(data[:size])


def test_no_frame_is_found_in_noise():
    """A checksum of 16 bits lets through one candidate of a known kind in 65536: 0.03 of the 2190 here."""
    data = noise(100_000, 6)
    cutter, candidates, outcomes = StreamCutter(), list[bytes](), Counter[str]()
    for begin in range(0, len(data), 256):
        candidates += cutter.feed(data[begin : begin + 256])
    for begin in range(len(data)):  # the payload of a datagram that begins there
        with suppress(WireError):
            candidates.append(next(split(data[begin : begin + 300])))
    decoder = FrameDecoder()
    for raw in candidates:
        try:
            decoder.decode(raw)
            outcomes["verified"] += 1
        except WireError as error:
            outcomes[error.reason] += 1
    assert outcomes["checksum"] > 2000 and outcomes["unknown_kind"] > 500, "the noise must look like frames"
    assert outcomes["verified"] == 0
    signed, decoder = Counter[str](), FrameDecoder(Signing(bytes(range(32)), 0))
    for raw in candidates:
        with pytest.raises(WireError) as refused:
            decoder.decode(raw)
        signed[refused.value.reason] += 1
    assert set(signed) == {"unsigned", "signature"}


def test_a_stream_is_cut_wherever_it_breaks():
    frames = [FrameEncoder(1, 1).encode(message) for message in MESSAGES]
    stream = b"\x00\x55" + b"".join(frames[:3]) + b"noise" + b"".join(frames[3:])
    for step in (1, 7, 64, 4096):
        cutter, found = StreamCutter(), []
        for begin in range(0, len(stream), step):
            found += cutter.feed(stream[begin : begin + step])
        assert found == frames
