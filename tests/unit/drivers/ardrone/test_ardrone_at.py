"""AT datagrams: irregular ones, as Parrot's own codec reads them (docs/reference/ardrone.md 2.1), and refused ones."""

import math

import pytest

from drivers.ardrone.wire import at
from drivers.ardrone.wire.errors import WireError

A, B = b"AT*REF=1,290717696", b"AT*PCMD=2,0,0,0,0,0"


@pytest.mark.parametrize(
    ("datagram", "names"),
    [
        (A + b"\r" + B + b"\r", ["REF", "PCMD"]),
        (A + b"\n" + B + b"\n", []),
        (A + b"\r\n" + B + b"\r\n", ["REF"]),
        (A + b"\r" + B, ["REF"]),
        (b"AT*CTRL=9,5\r", []),
        (b"AT*CTRL=0\r", []),
        (b"AT*REF=1, 290717696\r", []),
        (b'AT*CONFIG=1,"","x"\r', []),
        (b"AT*PCMD=1,1,0.5,0,0,0\r", []),
        (b"at*ref=1,290717696\r", []),
        (A + b"\rgarbage\xff\x00\r" + B + b"\r", ["REF", "PCMD"]),
        (A + b"\r\x00" + B + b"\r", ["REF"]),
        (b"\r", []),
        (b"", []),
        (b"AT*UNKNOWN=1\r", []),
        (b'AT*REF=1,"text"\r', []),
        (b"AT*PMODE=1,2\rAT*MISC=2,2,20,2000,3000\r", ["PMODE", "MISC"]),
    ],
)
@pytest.mark.parametrize("strict", [False, True])
def test_at_datagrams_are_decoded_as_by_a_real_drone(datagram, names, strict):
    assert [command.name for command in at.decode_datagram(datagram, strict)] == names


@pytest.mark.parametrize(("line", "name"), [(b"AT*COMWDG=3,\r", "COMWDG"), (b"AT*FTRIM=4,\r", "FTRIM")])
def test_a_trailing_comma_is_accepted_unless_strict(line, name):
    assert [command.name for command in at.decode_datagram(line)] == [name]
    assert at.decode_datagram(line, strict=True) == []


def test_numbers_wrap_as_in_the_drone():
    (command,) = at.decode_datagram(b"AT*REF=4294967295,4294967295\r")
    assert (command.sequence, command.arguments) == (-1, (-1,))


def test_a_datagram_of_1024_bytes_is_dropped_whole():
    padding = b"x" * (1023 - len(A) - 2)
    assert len(at.decode_datagram(A + b"\r" + padding + b"\r")) == 1
    assert at.decode_datagram(A + b"\r" + padding + b"x\r") == []


def test_bare_reference_bits_are_kept_as_sent():
    (command,) = at.decode_datagram(b"AT*REF=1,512\r")
    assert command.integer(0) & at.REF_START


def test_motion_is_clamped_on_both_sides():
    assert at.pcmd(at.ProgressiveMotion(1, phi=3.0)) == at.pcmd(at.ProgressiveMotion(1, phi=1.0))
    wild = at.AtCommand("PCMD", (1, at.bits_from_float(1.65), at.bits_from_float(-9.0), 0, 0))
    assert at.decode_motion(wild) == at.ProgressiveMotion(1, 1.0, -1.0)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_numbers_that_are_none_are_neither_sent_nor_obeyed(value):
    if value != value:
        with pytest.raises(WireError):
            at.pcmd(at.ProgressiveMotion(1, value))
    bits = {math.inf: 0x7F800000, -math.inf: -0x00800000}.get(value, 0x7FC00000)
    with pytest.raises(WireError):
        at.decode_motion(at.AtCommand("PCMD", (1, bits, 0, 0, 0)))


@pytest.mark.parametrize("text", ["", 'with "quotes"', "line\rbreak", "x" * 128, "\x00", "snowman \N{SNOWMAN}"])
def test_strings_that_the_grammar_cannot_carry(text):
    with pytest.raises(WireError):
        at.encode(at.config("custom:session_desc", text), 1)


def test_datagram_numbers_rise_by_one_and_its_length_is_bounded():
    datagram = at.encode_datagram([at.comwdg(), at.ref(False), at.pcmd(at.ProgressiveMotion())], 41)
    assert [command.sequence for command in at.decode_datagram(datagram)] == [41, 42, 43]
    with pytest.raises(WireError):
        at.encode_datagram([at.config("k" * 100, "v" * 100)] * 5, 1)


def test_arguments_are_read_by_type():
    command = at.AtCommand("CONFIG", ("key", "value"))
    assert command.text(1) == "value"
    with pytest.raises(WireError):
        command.integer(0)
    with pytest.raises(WireError):
        at.AtCommand("REF", (1,)).text(0)
    with pytest.raises(WireError):
        at.AtCommand("REF").integer(0)


@pytest.mark.parametrize(
    ("line", "count"),
    [
        ("ZAP=5,1", 1),
        ("CAD=5,2,1", 2),
        ("VISP=5,1,2,3", 3),
        ("VISO=5,1", 1),
        ("CAP=5,1,2", 2),
        ("GAIN=5," + ",".join("7" * 13), 13),
        ("POL=5,1,2,3,4,5", 5),
        ("PWM=5,100,-100,3,4", 4),
        ("AFLIGHT=5,1", 1),
        ("VICON=5," + ",".join("7" * 22), 22),
        ("MTRIM=5,0,1036831949,-1102263091", 3),
        ("PCMD_MAG=5,7,0,0,0,0,1056964608,1036831949", 7),
        ("ANIM=5,19,15", 2),
        ("LED=5,20,1073741824,3", 3),
    ],
)
def test_every_command_of_the_sheet_is_known_with_its_arguments(line, count):
    (command,) = at.decode_datagram(f"AT*{line}\r".encode(), strict=True)
    assert (command.sequence, len(command.arguments)) == (5, count)
    assert at.encode(command, 5) == f"AT*{line}\r".encode()
    if command.name not in ("VISP", "VISO", "CAP"):
        assert at.decode_datagram(f"AT*{line},1\r".encode()) == [], "one argument too many"
