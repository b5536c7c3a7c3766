"""REQUEST_EVENT, by which a ground station asks a PX4 for events that it has missed. pymavlink does not know it."""

import struct
from typing import NamedTuple

from drivers.mavlink.wire.signature import HEADER

REQUEST_EVENT = 412
_PAYLOAD = struct.Struct("<HHBB")


class EventRequest(NamedTuple):
    """What is asked for: sequence numbers (modulo 65536) of the first and the last event, and of whom."""

    first: int
    last: int
    system: int
    component: int


def event_request_of(frame: bytes) -> EventRequest:
    """Return the content of a verified frame of MAVLink 2.

    WIRE (docs/reference/mavlink.md 5.10, 5.11): fields in the order of their sizes; trailing zero bytes are left out.
    """
    payload = frame[HEADER : HEADER + frame[1]]
    return EventRequest(*_PAYLOAD.unpack(payload[: _PAYLOAD.size].ljust(_PAYLOAD.size, b"\0")))
