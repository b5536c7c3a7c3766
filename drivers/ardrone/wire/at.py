"""AT commands: ASCII lines `AT*NAME=<seq>[,<argument>]*<CR>` with floats printed as their 32 bits.

Builders return commands without a sequence number; `encode` gives them one. `decode_datagram` is the drone's side.
"""

import math
import re
import struct
from collections.abc import Sequence
from typing import NamedTuple

from drivers.ardrone.wire.errors import WireError

# WIRE: Parrot's codec discards a whole datagram of 1024 bytes or more; stay well below.
MAX_DATAGRAM = 1000
CODEC_LIMIT = 1024
MAX_STRING = 127

# WIRE: bits 18, 20, 22, 24, 28 are always 1; bit 9 = start (level), bit 8 = select emergency (rising edge toggles).
REF_BASE = 0x11540000
REF_START = 1 << 9
REF_SELECT = 1 << 8

PCMD_PROGRESSIVE = 1 << 0
PCMD_COMBINED_YAW = 1 << 1
PCMD_ABSOLUTE = 1 << 2

CTRL_CONFIG_GET = 4
CTRL_ACK = 5
CTRL_CUSTOM_CONFIG_GET = 6

# Arguments of each command: i integer or float bits, s string; None: not documented, any.
_SIGNATURES: dict[str, str | None] = {
    "REF": "i",
    "PCMD": "iiiii",
    "PCMD_MAG": "iiiiiii",
    "FTRIM": "",
    "CALIB": "i",
    "CONFIG": "ss",
    "CONFIG_IDS": "sss",
    "CTRL": "ii",
    "COMWDG": "",
    "LED": "iii",
    "ANIM": "ii",
    "MTRIM": "iii",
    "PMODE": "i",
    "MISC": "iiii",
    "ZAP": "i",
    "CAD": "ii",
    "VISP": None,
    "VISO": None,
    "CAP": None,
    "GAIN": "i" * 13,
    "POL": "i" * 5,
    "PWM": "iiii",
    "AFLIGHT": "i",
    "VICON": "i" * 22,
}

Argument = int | str


class AtCommand(NamedTuple):
    """A command; floats stand among the arguments as their bits."""

    name: str
    arguments: tuple[Argument, ...] = ()
    sequence: int = 0

    def integer(self, index: int) -> int:
        """Return an integer argument; raises WireError (argument) if it is none."""
        value = self.arguments[index] if index < len(self.arguments) else ""
        if isinstance(value, str):
            raise WireError("argument", f"{self.name} argument {index} is no number")
        return value

    def real(self, index: int) -> float:
        """Return a float argument, which may be any bit pattern; raises WireError (argument)."""
        return float_from_bits(self.integer(index))

    def text(self, index: int) -> str:
        """Return a string argument; raises WireError (argument) if it is none."""
        value = self.arguments[index] if index < len(self.arguments) else 0
        if isinstance(value, int):
            raise WireError("argument", f"{self.name} argument {index} is no string")
        return value


class ProgressiveMotion(NamedTuple):
    """Progressive motion, each -1..1 of the configured limits.

    flags: `PCMD_*` (0: hover); phi > 0 right, theta > 0 backward (nose up), gaz > 0 up, yaw > 0 clockwise; psi: heading
    of the controller against north, clockwise, 1 = 180 deg.
    """

    flags: int = 0
    phi: float = 0.0
    theta: float = 0.0
    gaz: float = 0.0
    yaw: float = 0.0
    psi: float = 0.0
    psi_accuracy: float = 0.0


def bits_from_float(value: float) -> int:
    """Return the 32 IEEE-754 bits as a signed integer; raises WireError (not_finite, value)."""
    if not math.isfinite(value):
        raise WireError("not_finite", str(value))
    try:
        return int(struct.unpack("<i", struct.pack("<f", value))[0])
    except OverflowError as error:
        raise WireError("value", str(error)) from error


def float_from_bits(bits: int) -> float:
    """Return the float whose 32 bits are printed as this integer."""
    return float(struct.unpack("<f", struct.pack("<I", bits & 0xFFFFFFFF))[0])


def ref(start: bool, select: bool = False) -> AtCommand:
    """Take off and stay up (start) or land; select is the emergency button."""
    return AtCommand("REF", (REF_BASE | start * REF_START | select * REF_SELECT,))


def pcmd(motion: ProgressiveMotion) -> AtCommand:
    """Move; the values are clamped to +-1."""
    return AtCommand("PCMD", (motion.flags, *(_fraction(value) for value in motion[1:5])))


def _fraction(value: float) -> int:
    clamped = value if -1.0 <= value <= 1.0 or value != value else math.copysign(1.0, value)
    return bits_from_float(clamped + 0.0)  # minus zero would be printed as -2147483648


def ftrim() -> AtCommand:
    """Take the present attitude as level; only while landed."""
    return AtCommand("FTRIM")


def config(key: str, value: str) -> AtCommand:
    """Set one configuration key."""
    return AtCommand("CONFIG", (key, value))


def config_ids(session: str, user: str, application: str) -> AtCommand:
    """Name the sets that the CONFIG right behind it (same datagram) writes to."""
    return AtCommand("CONFIG_IDS", (session, user, application))


def ctrl(mode: int) -> AtCommand:
    """Request a control mode (`CTRL_*`)."""
    return AtCommand("CTRL", (mode, 0))


def comwdg() -> AtCommand:
    """Reset the communication watchdog."""
    return AtCommand("COMWDG")


def led(animation: int, frequency_hz: float, duration_s: int) -> AtCommand:
    """Blink the LEDs."""
    return AtCommand("LED", (animation, bits_from_float(frequency_hz), duration_s))


def encode(command: AtCommand, sequence: int) -> bytes:
    """Return one command line with its CR; raises WireError for strings that the grammar cannot carry."""
    arguments = "".join("," + _encode_argument(argument) for argument in command.arguments)
    return f"AT*{command.name}={sequence}{arguments}\r".encode("latin-1")


def _encode_argument(argument: Argument) -> str:
    if isinstance(argument, int):
        return str(argument)
    # WIRE: no escaping exists, and the empty string makes the drone ignore the command.
    if not 0 < len(argument) <= MAX_STRING or any(not 32 <= ord(c) < 256 or c == '"' for c in argument):
        raise WireError("argument", f"string {argument!r}")
    return f'"{argument}"'


def encode_datagram(commands: Sequence[AtCommand], first_sequence: int, before: bytes = b"") -> bytes:
    """Return the commands with consecutive sequence numbers, behind encoded ones.

    Raises WireError (too_long) above 1000 bytes.
    """
    datagram = before + b"".join(encode(command, first_sequence + i) for i, command in enumerate(commands))
    if len(datagram) > MAX_DATAGRAM:
        raise WireError("too_long", f"{len(datagram)} bytes")
    return datagram


_LINE = re.compile(rb'AT\*([A-Z_]+)=(-?\d{1,10})((?:,(?:-?\d{1,10}|"[^"]{1,127}"))*)(,?)')
_ARGUMENT = re.compile(rb',(?:(-?\d{1,10})|"([^"]{1,127})")')


def decode_datagram(datagram: bytes, strict: bool = False) -> list[AtCommand]:
    """Return the commands a drone would obey; never raises.

    WIRE: as Parrot's own codec does (docs/reference/ardrone.md 2.1): only CR ends a command; a command that is
    malformed, unknown or has the wrong number of arguments is skipped, and a datagram of 1024 bytes or more is dropped
    whole. A trailing comma is accepted unless strict: several clients that fly real drones send it.
    """
    if len(datagram) >= CODEC_LIMIT:
        return []
    lines = datagram.split(b"\r")[:-1]
    return [command for line in lines if (command := _decode_line(line, strict)) is not None]


def _decode_line(line: bytes, strict: bool) -> AtCommand | None:
    match = _LINE.fullmatch(line)
    if match is None or (strict and match[4]):
        return None
    name = match[1].decode("ascii")
    arguments = tuple(
        _signed(int(number)) if number else text.decode("latin-1") for number, text in _ARGUMENT.findall(match[3])
    )
    kinds = "".join("s" if isinstance(argument, str) else "i" for argument in arguments)
    if name not in _SIGNATURES or _SIGNATURES[name] not in (None, kinds):
        return None
    return AtCommand(name, arguments, _signed(int(match[2])))


def _signed(value: int) -> int:
    # WIRE: 4294967295 is read as -1.
    return (value + (1 << 31)) % (1 << 32) - (1 << 31)


def decode_motion(command: AtCommand) -> ProgressiveMotion:
    """Return the motion of a PCMD or PCMD_MAG, clamped to +-1.

    Raises WireError (argument, not_finite). WIRE: clients in the field send values outside +-1.
    """
    values = [command.real(index) for index in range(1, len(command.arguments))]
    if not all(map(math.isfinite, values)):
        raise WireError("not_finite", command.name)
    return ProgressiveMotion(command.integer(0), *(min(1.0, max(-1.0, value)) for value in values))
