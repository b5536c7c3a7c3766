"""Verifies frames before their content is used: signature, checksum, time of signing. No decoding.

A frame of any kind of the standard, or that pymavlink's widest dialect knows, can be verified, whether or not this
project uses it; a frame of another kind cannot, because its checksum needs a seed from its definition.
"""

import hmac
from dataclasses import dataclass

from pymavlink.dialects.v20 import all as widest

from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.signature import (
    CHECKSUM,
    HEADER,
    HEADER_1,
    MAGIC_1,
    SIGNATURE,
    SIGNED,
    digest,
    frame_size,
    old_frame_size,
)

# WIRE (pymavlink): a new sender may sign with a time up to a minute old [10 us].
_NEW_SENDER_LAG = 6_000_000
# WIRE (docs/reference/mavlink.md 5.10): the seed comes from a message's definition: other dialects fail. pymavlink's
# definitions are ArduPilot's, which lack these of the standard (common.xml, minimal.xml); a PX4 sends many unrequested.
_STANDARD_EXTRA = {
    8: 117,  # LINK_NODE_STATUS
    80: 14,  # COMMAND_CANCEL
    290: 251,  # ESC_INFO
    291: 10,  # ESC_STATUS
    300: 217,  # PROTOCOL_VERSION
    334: 72,  # CELLULAR_STATUS
    336: 245,  # CELLULAR_CONFIG
    371: 10,  # FUEL_STATUS
    372: 26,  # BATTERY_INFO
    380: 232,  # TIME_ESTIMATE_TO_TARGET
    395: 0,  # COMPONENT_INFORMATION
    396: 50,  # COMPONENT_INFORMATION_BASIC
    397: 182,  # COMPONENT_METADATA
    400: 110,  # PLAY_TUNE_V2
    401: 183,  # SUPPORTED_TUNES
    410: 160,  # EVENT
    411: 106,  # CURRENT_EVENT_SEQUENCE
    412: 33,  # REQUEST_EVENT
    413: 77,  # RESPONSE_EVENT_ERROR
    440: 66,  # ILLUMINATOR_STATUS
}
_EXTRA = _STANDARD_EXTRA | {number: kind.crc_extra for number, kind in widest.mavlink_map.items()}
_CRC_EXTRA = {number: bytes([extra]) for number, extra in _EXTRA.items()}


@dataclass(frozen=True, slots=True)
class Signing:
    """A key of 32 bytes, and the time from which we sign [10 us since 2015-01-01 UTC]."""

    key: bytes
    timestamp: int
    link_id: int = 1


def number_of(frame: bytes) -> int:
    """Return the number of the kind of message in a frame."""
    return int.from_bytes(frame[7:10], "little")


class Verifier:
    """Verifies the frames of one link: the checksum, and with a key the signature and the order of its times.

    newest: the newest time of signing that was received, or the one from which we began [10 us since 2015-01-01 UTC].
    """

    def __init__(self, signing: Signing | None = None) -> None:
        self._key = None if signing is None else signing.key
        self.newest = 0 if signing is None else signing.timestamp
        self._stamps: dict[tuple[int, int, int], int] = {}

    def verify(self, frame: bytes) -> None:
        """Return if the frame is whole and genuine; raises WireError.

        Reasons: size, unsigned, signature, unknown_kind, checksum, replayed.
        """
        if len(frame) < HEADER + CHECKSUM or frame_size(frame) != len(frame):
            raise WireError("size", f"{len(frame)} bytes")
        if self._key is not None:
            check_signature(frame, self._key)
        _check_sum(frame)
        if self._key is not None:
            self._check_time(frame)

    def verify_old(self, frame: bytes) -> None:
        """Return if a frame of MAVLink 1 is whole; raises WireError (with a key unsigned; those of old_sender)."""
        system = old_sender(frame)
        if self._key is not None:
            raise WireError("unsigned", f"from system {system}")

    def _check_time(self, frame: bytes) -> None:
        # WIRE (docs/reference/mavlink.md 5.9): times of one sender on one of its links grow from frame to frame.
        sender = (frame[-SIGNATURE], frame[5], frame[6])
        stamp = int.from_bytes(frame[-12:-6], "little")
        if stamp <= self._stamps.get(sender, self.newest - _NEW_SENDER_LAG - 1):
            raise WireError("replayed", f"from system {frame[5]}")
        self._stamps[sender] = stamp
        self.newest = max(self.newest, stamp)


def check_signature(frame: bytes, key: bytes) -> None:
    """Return if a whole frame is signed with a key, at whatever time; raises WireError (unsigned, signature)."""
    if not frame[2] & SIGNED:
        raise WireError("unsigned", f"from system {frame[5]}")
    if not hmac.compare_digest(digest(key, frame[:-6]), frame[-6:]):
        raise WireError("signature", f"from system {frame[5]}")


def _check_sum(frame: bytes) -> None:
    _compare_sum(frame, HEADER + frame[1], number_of(frame), frame[5])


def _compare_sum(frame: bytes, end: int, number: int, system: int) -> None:
    extra = _CRC_EXTRA.get(number)
    if extra is None:
        raise WireError("unknown_kind", f"message {number} from system {system}")
    if widest.x25crc(frame[1:end] + extra).crc != int.from_bytes(frame[end : end + CHECKSUM], "little"):
        raise WireError("checksum", f"message {number} from system {system}")


def is_whole(frame: bytes) -> bool:
    """Return whether a frame of MAVLink 1 or 2 is of a known kind and has the right checksum, genuine or not."""
    try:
        if frame[0] == MAGIC_1:
            old_sender(frame)
        else:
            _check_sum(frame)
    except WireError:
        return False
    return True


def old_sender(frame: bytes) -> int:
    """Return the system that sent a whole frame of MAVLink 1; raises WireError (mavlink_2, size, or as for others).

    WIRE (docs/reference/mavlink.md 5.10): bytes 3 and 5 are system and number; it has the checksum of MAVLink 2.
    """
    if frame[:1] != bytes([MAGIC_1]):
        raise WireError("mavlink_2", f"{len(frame)} bytes")
    if len(frame) < HEADER_1 + CHECKSUM or old_frame_size(frame) != len(frame):
        raise WireError("size", f"{len(frame)} bytes")
    _compare_sum(frame, HEADER_1 + frame[1], frame[5], frame[3])
    return frame[3]
