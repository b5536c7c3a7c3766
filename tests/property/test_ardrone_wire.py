"""The AR.Drone codec under arbitrary bytes and values."""

import pytest
from fuzzed_wire import full_packet, read_navdata
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.ardrone.wire import at, navdata
from drivers.ardrone.wire.errors import WireError
from drivers.ardrone.wire.navdata import Navdata
from drivers.ardrone.wire.tags import OPTION_SIZES

U32 = st.integers(0, 2**32 - 1)
I32 = st.integers(-(2**31), 2**31 - 1)
OPTIONS = st.lists(st.tuples(st.integers(0, 0xFFFE), st.binary(max_size=60)), max_size=8).map(tuple)
TEXT = st.text(st.characters(min_codepoint=32, max_codepoint=255, exclude_characters='"'), min_size=1, max_size=127)


@given(U32, U32, U32, OPTIONS)
@settings(max_examples=50, deadline=None)
def test_encoded_navdata_is_decoded_unchanged(state, sequence, vision, payloads):
    packet = Navdata(state, sequence, vision, payloads)
    assert navdata.decode(navdata.encode(packet)) == packet


@given(st.binary(max_size=200), st.booleans())
@settings(max_examples=50, deadline=None)
def test_arbitrary_bytes_raise_nothing_but_wire_errors(data, strict):
    for datagram in (data, full_packet("ar2-2.3")[:16] + data):
        try:
            read_navdata((datagram, strict))
        except WireError as error:
            assert error.reason
    at.decode_datagram(data)


@pytest.mark.parametrize("profile", OPTION_SIZES)
def test_a_packet_cut_at_any_byte_is_refused(profile):
    packet = full_packet(profile)
    for length in range(len(packet)):
        try:
            read_navdata((packet[:length], True))
        except WireError:
            continue
        raise AssertionError(f"{length} of {len(packet)} bytes were accepted")


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
