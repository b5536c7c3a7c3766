"""The AR.Drone codec under arbitrary bytes and values."""

import random
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.ardrone.wire import at, navdata, options, pave
from drivers.ardrone.wire.errors import WireError
from drivers.ardrone.wire.navdata import Navdata
from drivers.ardrone.wire.tags import OPTION_SIZES

U32 = st.integers(0, 2**32 - 1)
I32 = st.integers(-(2**31), 2**31 - 1)
OPTIONS = st.lists(st.tuples(st.integers(0, 0xFFFE), st.binary(max_size=60)), max_size=8).map(tuple)
TEXT = st.text(st.characters(min_codepoint=32, max_codepoint=255, exclude_characters='"'), min_size=1, max_size=127)


def full_packet(profile: str = "ar2-2.3") -> bytes:
    sizes = OPTION_SIZES[profile]
    typed = {int(layout.tag): layout for layout in options.LAYOUTS if layout.start == 4}
    values = {0: options.Demo(), 1: options.Time(), 3: options.PhysMeasures(), 10: options.Altitude()}
    payloads = [
        (tag, typed[tag].encode(values[tag], size) if tag in values else bytes(size - 4)) for tag, size in sizes.items()
    ]
    return navdata.encode(Navdata(0x0F800000, 9, 0, tuple(payloads)))


def read_all(datagram: bytes, strict: bool) -> None:
    packet = navdata.decode(datagram, strict)
    for layout in options.LAYOUTS:
        packet.read(layout)


@given(U32, U32, U32, OPTIONS)
@settings(max_examples=50, deadline=None)
def test_what_is_encoded_is_decoded(state, sequence, vision, payloads):
    packet = Navdata(state, sequence, vision, payloads)
    assert navdata.decode(navdata.encode(packet)) == packet


@given(st.binary(max_size=200), st.booleans())
@settings(max_examples=50, deadline=None)
def test_arbitrary_bytes_raise_nothing_but_wire_errors(data, strict):
    for datagram in (data, full_packet()[:16] + data):
        try:
            read_all(datagram, strict)
        except WireError as error:
            assert error.reason
    at.decode_datagram(data)


def mutate(packet: bytes, count: int, seed: int) -> None:
    """Damage a packet in a few bytes, again and again, half of the time with a checksum that is right again."""
    rng = random.Random(seed)
    for _ in range(count):
        mutated = bytearray(packet)
        for _ in range(rng.randint(1, 4)):
            mutated[rng.choice((rng.randrange(len(mutated)), rng.randrange(200)))] = rng.randrange(256)
        if rng.random() < 0.5:
            mutated[-4:] = navdata.checksum(bytes(mutated[:-8])).to_bytes(4, "little")
        try:
            read_all(bytes(mutated), strict=rng.random() < 0.5)
        except WireError as error:
            assert error.reason


def mutate_commands(count: int, seed: int) -> None:
    """Damage a datagram of commands, again and again; decoding never raises, reading arguments only WireError."""
    rng = random.Random(seed)
    datagram = at.encode_datagram(
        [
            at.ref(True),
            at.pcmd(at.ProgressiveMotion(1, 0.1, -0.2, 0.3, 0.4)),
            at.config("control:outdoor", "TRUE"),
            at.ctrl(5),
        ],
        9,
    )
    for _ in range(count):
        mutated = bytearray(datagram)
        for _ in range(rng.randint(1, 3)):
            mutated[rng.randrange(len(mutated))] = rng.choice((rng.randrange(256), *b'\r\n,=*09"-'))
        for command in at.decode_datagram(bytes(mutated)):
            try:
                at.decode_motion(command) if command.name == "PCMD" else command.text(0)
            except WireError as error:
                assert error.reason


def mutate_frames(count: int, seed: int) -> None:
    """Damage a video stream and read on; a good frame behind the damage is found or its bytes are waited for."""
    rng, reader = random.Random(seed), pave.FrameReader()
    head = struct.pack("<4sBBHIHHHHIIBBBB", b"PaVE", 2, 4, 64, 90, 640, 368, 640, 360, 1, 2, 1, 0, 3, 0)
    stream = (head.ljust(64, b"\0") + bytes(90)) * 4
    for _ in range(count // 4):
        mutated = bytearray(stream)
        for _ in range(rng.randint(1, 3)):
            mutated[rng.randrange(len(mutated))] = rng.randrange(256)
        for frame in reader.feed(bytes(mutated)):
            assert len(frame.payload) <= 4_000_000


@pytest.mark.parametrize("profile", OPTION_SIZES)
def test_a_packet_cut_at_any_byte_is_refused(profile):
    packet = full_packet(profile)
    for length in range(len(packet)):
        try:
            read_all(packet[:length], strict=True)
        except WireError:
            continue
        raise AssertionError(f"{length} of {len(packet)} bytes were accepted")


def test_ten_thousand_mutations_raise_nothing_but_wire_errors():
    mutate(full_packet(), 6_000, 20)
    mutate(full_packet("ar1-1.7"), 2_000, 21)
    mutate_commands(1_000, 22)
    mutate_frames(1_000, 23)


@pytest.mark.slow
@pytest.mark.fuzz
@pytest.mark.timeout(600)
def test_a_million_mutations_raise_nothing_but_wire_errors():
    mutate(full_packet(), 400_000, 1)
    mutate(full_packet("ar2-2.4.8"), 150_000, 2)
    mutate(full_packet("ar1-1.7"), 150_000, 3)
    mutate_commands(200_000, 4)
    mutate_frames(100_000, 5)


@given(st.lists(st.tuples(TEXT, TEXT), max_size=3), st.integers(1, 2**31 - 5))
@settings(max_examples=50, deadline=None)
def test_configuration_commands_survive(pairs, first):
    commands = [at.config(key, value) for key, value in pairs]
    decoded = at.decode_datagram(at.encode_datagram(commands, first), strict=True)
    assert decoded == [command._replace(sequence=first + i) for i, command in enumerate(commands)]


@given(st.integers(0, 7), st.tuples(*[st.floats(-1, 1, width=32)] * 4))
@settings(max_examples=50, deadline=None)
def test_motions_survive(flags, fractions):
    motion = at.ProgressiveMotion(flags, *fractions)
    (command,) = at.decode_datagram(at.encode_datagram([at.pcmd(motion)], 1))
    assert at.decode_motion(command) == motion


@given(st.lists(st.sampled_from([b"AT*REF=1,512", b"\r", b"\n", b",", b'"', b"\0", b"AT*", b"=9"]), max_size=30))
@settings(max_examples=50, deadline=None)
def test_no_mixture_of_command_pieces_raises(pieces):
    for command in at.decode_datagram(b"".join(pieces)):
        assert command.name == "REF"
