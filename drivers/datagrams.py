"""Raw datagrams for the recording: several in one bus message, each with its stamp and length.

Framing of a RAW_RX or RAW_TX payload, repeated: int64 stamp_ns, uint32 length, then that many bytes; little-endian.
"""

import struct
import threading

from groundstation.bus.api import Bus
from groundstation.bus.topics import RAW_RX, RAW_TX

_HEAD = struct.Struct("<qI")
_Stamped = tuple[int, bytes]


def pack(datagrams: list[tuple[int, bytes]]) -> bytes:
    """Return the framing of (stamp_ns, datagram) pairs."""
    parts: list[bytes] = []
    for stamp_ns, datagram in datagrams:
        parts += (_HEAD.pack(stamp_ns, len(datagram)), datagram)
    return b"".join(parts)


def unpack(payload: bytes) -> list[tuple[int, bytes]]:
    """Return the (stamp_ns, datagram) pairs of a payload; raises ValueError when it is cut short."""
    datagrams = []
    offset = 0
    while offset < len(payload):
        if len(payload) - offset < _HEAD.size:
            raise ValueError("datagram head is cut short")
        stamp_ns, length = _HEAD.unpack_from(payload, offset)
        offset += _HEAD.size
        if length > len(payload) - offset:
            raise ValueError("datagram is cut short")
        datagrams.append((stamp_ns, payload[offset : offset + length]))
        offset += length
    return datagrams


class DatagramLog:
    """Collects the datagrams of one vehicle's link, from any thread, and publishes them in batches."""

    def __init__(self, bus: Bus, entity: str, enabled: bool = True) -> None:
        self._bus = bus
        self._entity = entity
        self._enabled = enabled
        self._lock = threading.Lock()
        self._received, self._sent = list[_Stamped](), list[_Stamped]()

    def received(self, stamp_ns: int, datagram: bytes) -> None:
        """Remember a datagram from the vehicle."""
        if self._enabled:
            with self._lock:
                self._received.append((stamp_ns, datagram))

    def sent(self, stamp_ns: int, datagram: bytes) -> None:
        """Remember a datagram to the vehicle."""
        if self._enabled:
            with self._lock:
                self._sent.append((stamp_ns, datagram))

    def flush(self) -> None:
        """Publish the collected datagrams, one message per direction, stamped as its first datagram."""
        with self._lock:
            batches = ((RAW_RX, self._received), (RAW_TX, self._sent))
            self._received, self._sent = [], []
        for topic, batch in batches:
            if batch:
                self._bus.publish_bytes(topic, self._bus.header(self._entity, batch[0][0]), pack(batch))
