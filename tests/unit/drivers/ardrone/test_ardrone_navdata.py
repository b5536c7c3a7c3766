"""Truncated, wrong and unusual navdata packets; configuration values."""

import pytest

from drivers.ardrone.wire import configuration, navdata, options
from drivers.ardrone.wire.errors import WireError
from drivers.ardrone.wire.navdata import Navdata
from drivers.ardrone.wire.state import ControlState, join_control_state, split_control_state

DEMO = options.DEMO.encode(options.Demo(altitude_mm=900), 148)
PACKET = navdata.encode(Navdata(0x0F800000, 5, 0, ((0, DEMO), (99, b"unknown tag"))))


def reason(datagram: bytes, strict: bool = True) -> str:
    with pytest.raises(WireError) as error:
        navdata.decode(datagram, strict)
    return error.value.reason


def test_unknown_tags_are_kept_and_skipped():
    packet = navdata.decode(PACKET)
    assert dict(packet.options)[99] == b"unknown tag"
    assert packet.read(options.DEMO) is not None
    assert packet.read(options.TIME) is None


def test_packets_of_one_length_may_hold_different_options():
    """The decoded layout of one says nothing about the next: sizes, tags, and the checksum's place."""
    cuts = [((1, b"abcd"), (2, b"efghij")), ((1, b"abcdef"), (2, b"ghij")), ((1, b"abcd"), (3, b"efghij"))]
    for options_in in (*cuts, *cuts):
        datagram = navdata.encode(Navdata(0, 1, 0, options_in))
        assert navdata.decode(datagram).options == options_in
        early = datagram[:16] + b"\xff\xff" + datagram[18:]
        assert reason(early) == "trailing_bytes"
        assert reason(datagram[:18] + b"\x03" + datagram[19:]) == "option_size"


def test_longer_options_of_newer_firmware_are_read_by_their_beginning():
    grown = options.PWM.encode(options.Pwm(motors=(1, 2, 3, 4)), 92) + b"more"
    pwm = Navdata(0, 1, 0, ((9, grown),)).read(options.PWM)
    assert pwm is not None and pwm.motors == (1, 2, 3, 4)


def test_an_option_shorter_than_needed_is_refused_when_it_is_read():
    with pytest.raises(WireError) as error:
        Navdata(0, 1, 0, ((0, b"\0" * 20),)).read(options.DEMO)
    assert error.value.reason == "option_size"


@pytest.mark.parametrize("size", [0, 1, 2, 3])
def test_an_option_that_cannot_be_aborts_the_packet(size):
    packet = bytearray(PACKET)
    packet[18:20] = size.to_bytes(2, "little")
    assert reason(bytes(packet)) == "option_size"


def test_each_refusal_has_its_own_word():
    assert reason(b"") == "too_short"
    assert reason(PACKET[:15]) == "too_short"
    assert reason(b"\0" * 4097) == "too_long"
    assert reason(b"\0" + PACKET[1:]) == "magic"
    assert reason(PACKET[:40]) == "truncated"
    assert reason(PACKET[:-8]) == "checksum_missing"
    assert reason(PACKET[:-1] + bytes([PACKET[-1] ^ 1])) == "checksum"
    assert reason(PACKET + b"\0") == "trailing_bytes"


def test_tolerant_mode_accepts_a_missing_checksum_but_no_wrong_one():
    assert navdata.decode(PACKET[:-8], strict=False).sequence == 5
    assert navdata.decode(PACKET + b"\0", strict=False).sequence == 5
    assert reason(PACKET[:-1] + bytes([PACKET[-1] ^ 1]), strict=False) == "checksum"


def test_alternative_magic_is_accepted():
    packet = navdata.encode(Navdata(0, 1, magic=0x55667789))
    assert navdata.decode(packet).magic == 0x55667789


def test_values_that_do_not_fit_are_wire_errors():
    with pytest.raises(WireError):
        options.DEMO.encode(options.Demo(battery_percent=-1))
    with pytest.raises(WireError):
        navdata.encode(Navdata(-1, 1))


def test_control_state_halves():
    assert split_control_state(6 << 16 | 1) == (ControlState.TRANS_TAKEOFF, 1)
    assert split_control_state(77 << 16) == (ControlState.DEFAULT, 0)
    assert join_control_state(ControlState.HOVERING, 8) == 4 << 16 | 8


def test_time_wraps_after_2048_seconds():
    assert options.Time.from_seconds(2048 + 1.5).seconds == pytest.approx(1.5)


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("general:navdata_demo", "FALSE", False),
        ("GENERAL:navdata_demo", "true", True),
        ("control:euler_angle_max", "0.25", 0.25),
        ("control:euler_angle_max", "9", 0.52),
        ("control:altitude_max", "20000", 20000),
        ("control:altitude_max", "1", 500),
        ("general:ardrone_name", "My Drone", "My Drone"),
    ],
)
def test_configuration_values(name, text, value):
    assert configuration.parse_value(name, text) == value


@pytest.mark.parametrize(
    ("name", "text"), [("no:such", "1"), ("control:altitude_max", "high"), ("video:codec_fps", "")]
)
def test_bad_configuration_values(name, text):
    with pytest.raises(WireError):
        configuration.parse_value(name, text)


def test_non_finite_configuration_values_are_refused():
    for text in ("nan", "inf", "-inf"):
        with pytest.raises(WireError):
            configuration.parse_value("control:euler_angle_max", text)


def test_dump_looks_like_a_real_one():
    dump = configuration.format_dump({"control:euler_angle_max": 0.20943999, "control:outdoor": False, "pic:x": 8})
    assert dump == b"control:euler_angle_max = 2.0943999e-01\ncontrol:outdoor = FALSE\npic:x = 8\n\0"
