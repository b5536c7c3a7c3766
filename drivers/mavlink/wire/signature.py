"""Length and signature of a frame, with the standard library alone, so that small processes can sign too."""

import hashlib

from drivers.mavlink.wire.errors import WireError

MAGIC, MAGIC_1 = 0xFD, 0xFE
HEADER, CHECKSUM, SIGNATURE = 10, 2, 13
HEADER_1 = 6
SIGNED = 1
_DIGEST = 6
_EPOCH_S = 1_420_070_400  # 2015-01-01 UTC


def frame_size(data: bytes | bytearray, offset: int = 0) -> int:
    """Return the length of the frame that begins at an offset; raises WireError (mavlink_1, no_frame, ...)."""
    if data[offset] != MAGIC:
        raise WireError("mavlink_1" if data[offset] == MAGIC_1 else "no_frame", f"byte {data[offset]:#x}")
    if len(data) - offset < 3:
        raise WireError("truncated", "header")
    flags = data[offset + 2]
    # WIRE (docs/reference/mavlink.md 5.10): a frame with an unknown incompatibility flag must be dropped.
    if flags & ~SIGNED:
        raise WireError("incompatible", f"flags {flags:#x}")
    return HEADER + int(data[offset + 1]) + CHECKSUM + (SIGNATURE if flags & SIGNED else 0)


def old_frame_size(data: bytes | bytearray, offset: int = 0) -> int:
    """Return the length of the frame of MAVLink 1 that begins at an offset; raises WireError (truncated)."""
    if len(data) - offset < 2:
        raise WireError("truncated", "header")
    return HEADER_1 + int(data[offset + 1]) + CHECKSUM


def stamp_at(unix_s: float) -> int:
    """Return the time of signing for a Unix time [10 us since 2015-01-01 UTC]."""
    return round((unix_s - _EPOCH_S) * 100_000)


def digest(key: bytes, signed: bytes) -> bytes:
    """Return the last bytes of a signed frame, from all before them."""
    # WIRE (docs/reference/mavlink.md 5.9): the first 6 bytes of SHA256(key, all before them).
    return hashlib.sha256(key + signed).digest()[:_DIGEST]


def signed_anew(datagram: bytes, key: bytes, link_id: int, stamp: int) -> tuple[bytes, int]:
    """Return a datagram of signed frames with other signatures, and the next free time; times grow by one a frame."""
    frames, offset = [], 0
    while offset < len(datagram):
        end = offset + frame_size(datagram, offset)
        body = datagram[offset : end - SIGNATURE] + bytes([link_id]) + stamp.to_bytes(6, "little")
        frames.append(body + digest(key, body))
        offset, stamp = end, stamp + 1
    return b"".join(frames), stamp
