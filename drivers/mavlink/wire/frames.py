"""Frames: cut a datagram, decode and encode one message, sign and check signatures. No sockets, no clock.

pymavlink's dialect knows layout, order, checksum seeds and signatures; this file decides what is refused and by which
name it is counted.
"""

import hashlib
import hmac
import re
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.wire import flight, service, telemetry
from drivers.mavlink.wire.errors import WireError

Message = tuple[Any, ...]
MAX_DATAGRAM = 2048
_MAGIC, _MAGIC_1 = 0xFD, 0xFE
_HEADER, _CHECKSUM, _SIGNATURE = 10, 2, 13
_SIGNED = 1


class Frame(NamedTuple):
    """Who said what; message is None for kinds that this project does not use. sequence counts per sender."""

    system: int
    component: int
    sequence: int
    message: Message | None


@dataclass(frozen=True, slots=True)
class Signing:
    """A key of 32 bytes, and the time from which we sign [10 us since 2015-01-01 UTC]."""

    key: bytes
    timestamp: int
    link_id: int = 1


def _classes() -> dict[str, type[Message]]:
    found = {}
    for module in (flight, service, telemetry):
        for name, value in vars(module).items():
            if (
                isinstance(value, type)
                and issubclass(value, tuple)
                and value is not tuple
                and hasattr(value, "_fields")
            ):
                found[re.sub(r"(?<!^)(?=[A-Z])", "_", name).upper()] = value
    return found


CLASSES = _classes()
IDS: dict[str, int] = {dialect.mavlink_map[number].msgname: number for number in dialect.mavlink_map}
_BY_ID = {IDS[name]: cls for name, cls in CLASSES.items()}
_NAMES = {cls: name for name, cls in CLASSES.items()}


def name_of(message: Message | type[Message]) -> str:
    """Return the MAVLink name of a message, such as HEARTBEAT."""
    return _NAMES[message if isinstance(message, type) else type(message)]


def id_of(kind: type[Message]) -> int:
    """Return the number of a kind of message."""
    return IDS[_NAMES[kind]]


def dialect_faults() -> list[str]:
    """Return where our messages differ from pymavlink's dialect; a missing field would be sent as 0."""
    faults = []
    for name, cls in CLASSES.items():
        known = dialect.mavlink_map[IDS[name]].fieldnames if name in IDS else []
        ours: Sequence[str] = getattr(cls, "_fields", ())
        if list(ours) != list(known):
            faults.append(f"{name}: has {', '.join(known)}, not {', '.join(ours)}")
    return faults


def split(data: bytes) -> Iterator[bytes]:
    """Yield the frames of a datagram; raises WireError at the first byte that begins none (the rest is dropped)."""
    offset = 0
    while offset < len(data):
        size = frame_size(data, offset)
        if size > len(data) - offset:
            raise WireError("truncated", f"{len(data) - offset} of {size} bytes")
        yield data[offset : offset + size]
        offset += size


def frame_size(data: bytes | bytearray, offset: int = 0) -> int:
    """Return the length of the frame that begins at an offset; raises WireError (mavlink_1, no_frame, ...)."""
    if data[offset] != _MAGIC:
        raise WireError("mavlink_1" if data[offset] == _MAGIC_1 else "no_frame", f"byte {data[offset]:#x}")
    if len(data) - offset < 3:
        raise WireError("truncated", "header")
    flags = data[offset + 2]
    # WIRE (mavlink.md 5.10): a frame with an incompatibility flag that is not understood must be dropped.
    if flags & ~_SIGNED:
        raise WireError("incompatible", f"flags {flags:#x}")
    return _HEADER + int(data[offset + 1]) + _CHECKSUM + (_SIGNATURE if flags & _SIGNED else 0)


class Decoder:
    """Turns frames of one link into messages; with a key, only rightly signed ones."""

    def __init__(self, signing: Signing | None = None) -> None:
        self._mav = _codec(0, 0, signing)
        self._key = None if signing is None else signing.key

    def decode(self, frame: bytes) -> Frame:
        """Return what a frame says; raises WireError (checksum, unsigned, signature, size, ...)."""
        if len(frame) < _HEADER + _CHECKSUM or frame_size(frame) != len(frame):
            raise WireError("size", f"{len(frame)} bytes")
        number = int.from_bytes(frame[7:10], "little")
        system, component, sequence = frame[5], frame[6], frame[4]
        cls = _BY_ID.get(number)
        if cls is None:
            return Frame(system, component, sequence, None)
        if self._key is not None:
            _verify(frame, self._key)
        try:
            decoded = self._mav.decode(bytearray(frame))
            values = [tuple(v) if isinstance(v, list) else v for v in map(decoded.__getattribute__, decoded.fieldnames)]
        except dialect.MAVError as error:
            raise WireError(_reason(str(error)), str(error)) from error
        except (struct.error, ValueError, IndexError, TypeError) as error:
            raise WireError("malformed", f"message {number}: {error}") from error
        return Frame(system, component, sequence, cls(*values))


def _verify(frame: bytes, key: bytes) -> None:
    # WIRE (mavlink.md 5.9): the last 6 bytes are of SHA256(key, all before them). Checked here before pymavlink sees
    # the frame, because pymavlink remembers the timestamp of a frame that it then finds to be forged.
    if not frame[2] & _SIGNED:
        raise WireError("unsigned", f"from system {frame[5]}")
    if not hmac.compare_digest(hashlib.sha256(key + frame[:-6]).digest()[:6], frame[-6:]):
        raise WireError("signature", f"from system {frame[5]}")


def _reason(text: str) -> str:
    for word, reason in (("CRC", "checksum"), ("ignature", "replayed"), ("length", "size")):
        if word in text:
            return reason
    return "malformed"


class Encoder:
    """Numbers, and with a key signs, what one component sends; one per sender, used by one thread at a time."""

    def __init__(self, system: int, component: int, signing: Signing | None = None) -> None:
        self._mav = _codec(system, component, signing)

    def encode(self, message: Message) -> bytes:
        """Return the frame of a message; raises WireError when a value does not fit its field."""
        try:
            fields = [v.encode("ascii", "replace") if isinstance(v, str) else v for v in message]
            packet = dialect.mavlink_map[id_of(type(message))](*fields)
            frame: bytes = packet.pack(self._mav)
            self._mav.seq = (self._mav.seq + 1) % 256
            return bytes(frame)
        except (struct.error, TypeError, OverflowError) as error:
            raise WireError("unencodable", f"{name_of(message)}: {error}") from error


def _codec(system: int, component: int, signing: Signing | None) -> Any:
    mav = dialect.MAVLink(None, srcSystem=system, srcComponent=component)
    if signing is not None:
        mav.signing.secret_key = signing.key
        mav.signing.sign_outgoing = True
        mav.signing.link_id = signing.link_id
        mav.signing.timestamp = signing.timestamp
    return mav
