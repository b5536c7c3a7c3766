"""Frames: split a datagram, decode and encode one message, sign it. No sockets, no clock.

pymavlink's dialect has layout and order, and signs; `verification.py` decides which frames are decoded at all.
"""

import re
import struct
from collections.abc import Iterator
from typing import Any, NamedTuple

from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.wire import flight, positioning, service, simulator, telemetry
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.signature import MAGIC_1, frame_size, old_frame_size
from drivers.mavlink.wire.verification import Signing, Verifier, number_of

Message = tuple[Any, ...]
MAX_DATAGRAM = 2048


class ReceivedFrame(NamedTuple):
    """A verified frame; message is None for kinds that this project does not use. sequence counts per sender."""

    system: int
    component: int
    sequence: int
    message: Message | None


def _classes() -> dict[str, type[Message]]:
    found = {}
    for module in (flight, positioning, service, simulator, telemetry):
        for name, value in vars(module).items():
            if (
                isinstance(value, type)
                and issubclass(value, tuple)
                and value is not tuple
                and hasattr(value, "_fields")
            ):
                # The suffix "Message" distinguishes classes that the bus has too; it is not part of the name on the
                # wire.
                found[re.sub(r"(?<!^)(?=[A-Z])", "_", name.removesuffix("Message")).upper()] = value
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


def fields_of(kind: type[Message]) -> tuple[str, ...]:
    """Return the names of a message's fields, in their order."""
    names: tuple[str, ...] = getattr(kind, "_fields", ())
    return names


def dialect_faults() -> list[str]:
    """Return where our messages differ from pymavlink's dialect; a missing field would be sent as 0."""
    faults = []
    for name, cls in CLASSES.items():
        known = dialect.mavlink_map[IDS[name]].fieldnames if name in IDS else []
        ours = fields_of(cls)
        if list(ours) != list(known):
            faults.append(f"{name}: has {', '.join(known)}, not {', '.join(ours)}")
    return faults


def split(data: bytes, *, old: bool = False) -> Iterator[bytes]:
    """Yield the frames of a datagram; raises WireError at the first byte that begins none (the rest is dropped).

    old: those of MAVLink 1 as well, which are recorded and never obeyed.
    """
    offset = 0
    while offset < len(data):
        size = old_frame_size(data, offset) if old and data[offset] == MAGIC_1 else frame_size(data, offset)
        if size > len(data) - offset:
            raise WireError("truncated", f"{len(data) - offset} of {size} bytes")
        yield data[offset : offset + size]
        offset += size


class FrameDecoder:
    """Turns frames of one link into messages; only verified frames count, with a key only correctly signed ones."""

    def __init__(self, signing: Signing | None = None) -> None:
        self._verifier = Verifier(signing)
        self._mav = dialect.MAVLink(None)

    @property
    def newest_stamp(self) -> int:
        """Return the newest time of signing that was received, or the one from which we began."""
        return self._verifier.newest

    def decode(self, frame: bytes) -> ReceivedFrame:
        """Return the message of a verified frame; raises WireError (those of Verifier.verify, malformed)."""
        self._verifier.verify(frame)
        return self._message_of(frame, number_of(frame), (frame[5], frame[6], frame[4]))

    def decode_old(self, frame: bytes) -> ReceivedFrame:
        """Return the message of a frame of MAVLink 1; raises WireError (those of Verifier.verify_old, malformed).

        Emulated vehicles understand it; no driver does.
        """
        self._verifier.verify_old(frame)
        return self._message_of(frame, frame[5], (frame[3], frame[4], frame[2]))

    def _message_of(self, frame: bytes, number: int, sender: tuple[int, int, int]) -> ReceivedFrame:
        system, component, sequence = sender
        cls = _BY_ID.get(number)
        if cls is None:
            return ReceivedFrame(system, component, sequence, None)
        try:
            decoded = self._mav.decode(bytearray(frame))
            values = [tuple(v) if isinstance(v, list) else v for v in map(decoded.__getattribute__, decoded.fieldnames)]
        except (dialect.MAVError, struct.error, ValueError, IndexError, TypeError) as error:
            raise WireError("malformed", f"message {number}: {error}") from error
        return ReceivedFrame(system, component, sequence, cls(*values))


class FrameEncoder:
    """Numbers, and with a key signs, the frames of one sending component; used by one thread at a time."""

    def __init__(self, system: int, component: int, signing: Signing | None = None) -> None:
        self._mav = dialect.MAVLink(None, srcSystem=system, srcComponent=component)
        if signing is not None:
            self._mav.signing.secret_key = signing.key
            self._mav.signing.sign_outgoing = True
            self._mav.signing.link_id = signing.link_id
            self._mav.signing.timestamp = signing.timestamp

    @property
    def newest_stamp(self) -> int:
        """Return the time from which the next frame is signed, 0 without a key."""
        signing = self._mav.signing
        return int(signing.timestamp) if signing.sign_outgoing else 0

    def encode(self, message: Message, old: bool = False, not_before: int = 0) -> bytes:
        """Return the frame of a message; raises WireError when a value does not fit its field.

        old: of MAVLink 1; not_before: the least time of signing [10 us since 2015-01-01 UTC]; times always grow.
        """
        signing = self._mav.signing
        signing.timestamp = max(signing.timestamp, not_before)
        try:
            fields = [v.encode("ascii", "replace") if isinstance(v, str) else v for v in message]
            packet = dialect.mavlink_map[id_of(type(message))](*fields)
            frame: bytes = packet.pack(self._mav, force_mavlink1=old)
            self._mav.seq = (self._mav.seq + 1) % 256
            return bytes(frame)
        except (struct.error, TypeError, OverflowError) as error:
            raise WireError("unencodable", f"{name_of(message)}: {error}") from error
