"""PaVE frames of the AR.Drone 2's video stream (TCP 5555), found again after damage.

WIRE (AR.Drone sheet 6): header sizes of 64, 68 and 76 bytes occur; the payload begins where `header_size` says.
"""

import struct
from dataclasses import dataclass
from enum import IntEnum

from drivers.ardrone.wire.errors import WireError

SIGNATURE = b"PaVE"
HEADER_SIZE = 64
_HEADER = struct.Struct("<4sBBHIHHHHIIBBBB")
_SIZES = range(HEADER_SIZE, 257)
# Larger than any picture of the drone: a length beyond it is damage, not a frame.
_LARGEST_PAYLOAD = 4_000_000


class FrameType(IntEnum):
    """What a frame holds; a decoder can start at an IDR."""

    UNKNOWN = 0
    IDR = 1
    INTRA = 2
    PREDICTED = 3
    HEADERS = 4


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame: codec 4 is H.264 (Annex B), size in pixels as displayed, time since power-on."""

    codec: int
    width: int
    height: int
    number: int
    timestamp_ms: int
    kind: FrameType
    payload: bytes


class FrameReader:
    """Cuts a byte stream into frames. `skipped` counts the bytes that belonged to none."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.skipped = 0

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that these bytes complete; damaged stretches are skipped up to the next signature."""
        self._buffer += data
        frames = []
        while self._resync() and len(self._buffer) >= HEADER_SIZE:
            try:
                start, end = _extent(self._buffer)
            except WireError:
                self._skip(1)
                continue
            if len(self._buffer) < end:
                break
            frames.append(_frame(bytes(self._buffer[:end]), start))
            del self._buffer[:end]
        return frames

    def _resync(self) -> bool:
        # Moves the buffer to the next signature; keeps a tail that may be the beginning of one.
        place = self._buffer.find(SIGNATURE)
        if place < 0:
            self._skip(max(0, len(self._buffer) - len(SIGNATURE) + 1))
            return False
        self._skip(place)
        return True

    def _skip(self, count: int) -> None:
        self.skipped += count
        del self._buffer[:count]


def _extent(data: bytearray) -> tuple[int, int]:
    fields = _HEADER.unpack_from(data)
    header_size, payload_size = fields[3], fields[4]
    if header_size not in _SIZES or payload_size > _LARGEST_PAYLOAD:
        raise WireError("pave_size", f"header {header_size}, payload {payload_size}")
    return header_size, header_size + payload_size


def _frame(data: bytes, start: int) -> Frame:
    _, _, codec, _, _, _, _, width, height, number, timestamp_ms, _, _, kind, _ = _HEADER.unpack_from(data)
    known = FrameType(kind) if kind in FrameType.__members__.values() else FrameType.UNKNOWN
    return Frame(codec, width, height, number, timestamp_ms, known, data[start:])
