"""PaVE frames of the AR.Drone 2's video stream (TCP 5555): encoding, and resynchronisation after damage.

WIRE (docs/reference/ardrone.md 6): headers have 64, 68 or 76 bytes; the payload begins where `header_size` says.
"""

import struct
from dataclasses import dataclass
from enum import IntEnum

from drivers.ardrone.wire.errors import WireError

SIGNATURE = b"PaVE"
HEADER_SIZE = 64
_HEADER = struct.Struct("<4sBBHIHHHHIIBBBBIIHBBBB2xI12x")
_VERSION = 2
_ADVERTISEMENT = 1
_BLOCK_PX = 16
_SIZES = range(HEADER_SIZE, 257)
# Larger than any picture of the drone: a length beyond it is damage, not a frame.
_LARGEST_PAYLOAD = 4_000_000


class FrameType(IntEnum):
    """Kind of a frame; a decoder can start at an IDR."""

    UNKNOWN = 0
    IDR = 1
    INTRA = 2
    PREDICTED = 3
    HEADERS = 4


@dataclass(frozen=True, slots=True)
class PaveFrame:
    """One frame: codec 4 is H.264 (Annex B), size in pixels as displayed, time since power-on.

    slices, slice_index: a picture sent in several frames of one number; stream: which encoder it comes from;
    parameter_sizes: bytes of SPS and PPS at the payload's beginning.
    """

    codec: int
    width: int
    height: int
    number: int
    timestamp_ms: int
    kind: FrameType
    payload: bytes
    slices: int = 1
    slice_index: int = 0
    stream: int = 0
    parameter_sizes: tuple[int, int] = (0, 0)


def encode_frame(frame: PaveFrame, position: int = 0, header_size: int = HEADER_SIZE) -> bytes:
    """Return a frame with its header of at least 64 bytes; position: bytes of the stream before it.

    Undescribed fields of a longer header are sent as 0.
    """
    # WIRE: pictures are encoded in whole blocks of 16 pixels: 640x368 for the 640x360 that are shown.
    blocks = (-(-side // _BLOCK_PX) * _BLOCK_PX for side in (frame.width, frame.height))
    header = _HEADER.pack(
        SIGNATURE,
        _VERSION,
        frame.codec,
        header_size,
        len(frame.payload),
        *blocks,
        frame.width,
        frame.height,
        frame.number & 0xFFFF_FFFF,
        frame.timestamp_ms & 0xFFFF_FFFF,
        1,
        0,
        frame.kind,
        0,
        position & 0xFFFF_FFFF,
        position >> 32 & 0xFFFF_FFFF,
        frame.stream,
        frame.slices,
        frame.slice_index,
        *frame.parameter_sizes,
        len(frame.payload),
    )
    return header.ljust(header_size, b"\0") + frame.payload


class FrameReader:
    """Cuts a byte stream into frames. `skipped` counts the bytes that belonged to none."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._looked = 0
        self.skipped = 0

    def feed(self, data: bytes) -> list[PaveFrame]:
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
                if not self._interrupted(start):
                    break
                continue
            frames.append(_frame(bytes(self._buffer[:end]), start))
            self._looked = 0
            del self._buffer[:end]
        return frames

    def _interrupted(self, start: int) -> bool:
        # A frame with a damaged length would swallow those behind it: a sound header inside shows that it ended.
        place = self._buffer.find(SIGNATURE, max(start, self._looked - len(SIGNATURE)))
        while place >= 0 and len(self._buffer) - place >= HEADER_SIZE:
            try:
                _extent(self._buffer, place)
            except WireError:
                place = self._buffer.find(SIGNATURE, place + 1)
                continue
            self._skip(place)
            return True
        self._looked = len(self._buffer) if place < 0 else place
        return False

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
        self._looked = 0
        del self._buffer[:count]


def _extent(data: bytearray, offset: int = 0) -> tuple[int, int]:
    fields = _HEADER.unpack_from(data, offset)
    header_size, payload_size, control = fields[3], fields[4], fields[14]
    if header_size not in _SIZES or payload_size > _LARGEST_PAYLOAD:
        raise WireError("pave_size", f"header {header_size}, payload {payload_size}")
    if control & _ADVERTISEMENT:  # WIRE: announces a stored frame; nothing follows
        return header_size, header_size
    return header_size, header_size + payload_size


def _frame(data: bytes, start: int) -> PaveFrame:
    fields = _HEADER.unpack_from(data)
    codec, width, height, number, timestamp_ms, kind = fields[2], *fields[7:11], fields[13]
    stream, slices, slice_index, *parameter_sizes = fields[17:22]
    known = FrameType(kind) if kind in FrameType.__members__.values() else FrameType.UNKNOWN
    return PaveFrame(
        codec,
        width,
        height,
        number,
        timestamp_ms,
        known,
        data[start:],
        max(1, slices),
        slice_index,
        stream,
        (parameter_sizes[0], parameter_sizes[1]),
    )
