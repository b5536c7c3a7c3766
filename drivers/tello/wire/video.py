"""The Tello's video: H.264 cut into datagrams.

WIRE (docs/reference/tello.md 4): a picture fills datagrams of 1460 bytes; a shorter one is its last. Nothing numbers
them. Parameter sets come before a key picture, in datagrams of their own.
"""

from typing import NamedTuple

WHOLE_BYTES = 1460
_START_CODE = b"\x00\x00\x01"
_PICTURE, _KEY_PICTURE, _PARAMETERS = 1, 5, 7
# Beyond any picture of its bit rate: the end of one was lost again and again.
_MOST_BYTES = 1 << 20


class AccessUnit(NamedTuple):
    """One picture with the parameter sets before it; starts: a decoder can begin here."""

    data: bytes
    starts: bool


class Assembly:
    """Datagrams to access units; `skipped` counts bytes that belong to none."""

    def __init__(self) -> None:
        self.skipped = 0
        self._data = bytearray()

    def feed(self, datagram: bytes) -> AccessUnit | None:
        """Return the access unit that a datagram completes."""
        self._data += datagram
        if len(datagram) >= WHOLE_BYTES and len(self._data) <= _MOST_BYTES:
            return None
        data = bytes(self._data)
        kinds = unit_kinds(data)
        if not {_PICTURE, _KEY_PICTURE} & kinds and kinds and len(data) <= _MOST_BYTES:
            return None  # parameter sets, which go with the picture that follows
        self._data.clear()
        if not kinds or len(data) > _MOST_BYTES:
            self.skipped += len(data)
            return None
        return AccessUnit(data, _KEY_PICTURE in kinds and _PARAMETERS in kinds)


def unit_kinds(data: bytes) -> set[int]:
    """Return the types of all NAL units in a piece of a byte stream (H.264, Annex B)."""
    kinds, place = set(), data.find(_START_CODE)
    while 0 <= place < len(data) - len(_START_CODE):
        kinds.add(data[place + len(_START_CODE)] & 0x1F)
        place = data.find(_START_CODE, place + len(_START_CODE))
    return kinds


def cut(data: bytes) -> list[bytes]:
    """Return the datagrams of a picture; a zero, which a stream may have, ends one that fills them all."""
    data += b"" if len(data) % WHOLE_BYTES else b"\x00"
    return [data[place : place + WHOLE_BYTES] for place in range(0, len(data), WHOLE_BYTES)]
