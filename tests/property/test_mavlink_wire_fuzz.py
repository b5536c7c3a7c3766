"""Whatever bytes come: nothing but counted refusals. 10^4 mutated frames here, 10^6 in the slow run."""

import random
from collections import Counter
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as widest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.convert import attitude_from_quaternion, imu_from_highres, velocity_from_local
from drivers.mavlink.links.serial import StreamCutter
from drivers.mavlink.wire import flight, service, telemetry
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.frames import FrameDecoder, FrameEncoder, split
from drivers.mavlink.wire.verification import Signing

FLOATS = st.floats(width=32, allow_nan=False, allow_infinity=False)
MESSAGES = (
    telemetry.Heartbeat(2, 12, 129, 6 << 16, 4),
    telemetry.LocalPositionNed(1, 1.0, 2.0, 3.0, 0.1, 0.2, 0.3),
    telemetry.AttitudeQuaternion(1, 1.0, 0.0, 0.0, 0.0, 0.1, 0.2, 0.3),
    telemetry.HighresImu(1, 0.0, 0.0, -9.8, 0.1, 0.2, 0.3),
    telemetry.RawImu(1, 0, 0, -1000, 1, 2, 3),
    telemetry.SysStatus(7, 7, 7, battery_remaining=80),
    telemetry.Statustext(4, "PreArm: something is wrong"),
    telemetry.BatteryStatus(0, 0, 3, 300, (4000,) * 10, 5, 5, 5, 90),
    service.ParamValue("GUID_TIMEOUT", 0.5, 9, 30, 2),
    service.Timesync(0, 99),
    flight.CommandAckMessage(400, 0),
    flight.SetPositionTargetLocalNed(1, 1, 1, 8, 1479, *(0.5,) * 11),
    flight.CommandLong(1, 1, 400, 0, 1.0),
    flight.OdometryMessage(1, 1, 12, 0, 0, 0, (1, 0, 0, 0), 0, 0, 0, 0, 0, 0, (0.0,) * 21, (0.0,) * 21),
)


def mutate(rng: random.Random, frame: bytes) -> bytes:
    """Change bytes, cut, repeat or splice; in half of the cases with a right checksum, to get past it."""
    data = bytearray(frame)
    for _ in range(rng.randrange(1, 4)):
        match rng.randrange(5):
            case 0 | 1:
                data[rng.randrange(len(data))] = rng.randrange(256)
            case 2:
                del data[rng.randrange(1, len(data)) :]
            case 3:
                data += bytes(rng.randrange(256) for _ in range(rng.randrange(1, 20)))
            case 4:
                place = rng.randrange(len(data))
                data[place:place] = data[: rng.randrange(1, 8)]
        if len(data) < 13:
            return bytes(data)
    if rng.random() < 0.5 and data[0] == 0xFD and not data[2]:
        data[1] = len(data) - 12 & 255
        number = int.from_bytes(data[7:10], "little")
        extra = dialect.mavlink_map[number].crc_extra if number in dialect.mavlink_map else 0
        crc = dialect.x25crc(bytes(data[1:-2]) + bytes([extra])).crc
        data[-2:] = crc.to_bytes(2, "little")
    return bytes(data)


def fuzz(count: int, seed: int) -> Counter[str]:
    rng, outcomes = random.Random(seed), Counter[str]()
    frames = [FrameEncoder(1, 1).encode(message) for message in MESSAGES]
    decoder = FrameDecoder()
    for _ in range(count):
        data = mutate(rng, rng.choice(frames))
        try:
            for raw in split(data):
                decoded = decoder.decode(raw).message
                use(decoded)
                outcomes["decoded"] += 1
        except WireError as error:
            outcomes[error.reason] += 1
    return outcomes


def use(message: object) -> None:
    match message:
        case telemetry.LocalPositionNed():
            velocity_from_local(message, attitude_from_quaternion(MESSAGES[2]))
        case telemetry.AttitudeQuaternion():
            attitude_from_quaternion(message)
        case telemetry.HighresImu():
            imu_from_highres(message)


def test_mutated_frames_are_refused_or_read():
    outcomes = fuzz(10_000, 1)
    assert sum(outcomes.values()) >= 10_000
    assert {"decoded", "checksum", "truncated", "no_frame"} <= set(outcomes)


@pytest.mark.slow
@pytest.mark.fuzz
@pytest.mark.timeout(900)
def test_a_million_mutated_frames():
    assert sum(fuzz(1_000_000, 2).values()) >= 1_000_000


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
    """Random bytes in which every 20th or so begins what could be a frame: a start, a length, a kind, no more."""
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
    for begin in range(len(data)):  # what a datagram that begins there would hold
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
