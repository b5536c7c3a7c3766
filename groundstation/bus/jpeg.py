"""The size of a JPEG from its head alone, so that it can be refused before it is decoded."""

from collections.abc import Iterator

_START = b"\xff\xd8"
_END = b"\xff\xd9"
# WIRE: ITU-T T.81 table B.1: start of frame, all kinds but the tables (C4, C8, CC) between them.
_FRAME_MARKERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_STANDALONE = frozenset({0x01, *range(0xD0, 0xD8)})
_SCAN = 0xDA
_MOST_SEGMENTS = 200


def _segments(data: bytes) -> Iterator[tuple[int, int]]:
    """Yield marker and place of each segment of a JPEG's head, up to its first scan."""
    place = len(_START) if data.startswith(_START) else len(data)
    for _ in range(_MOST_SEGMENTS):
        while data[place : place + 2] == b"\xff\xff":  # fill bytes
            place += 1
        if len(data) < place + 4 or data[place] != 0xFF:
            return
        marker = data[place + 1]
        yield marker, place
        if marker == _SCAN:
            return
        place += 2 if marker in _STANDALONE else 2 + int.from_bytes(data[place + 2 : place + 4])


def stated_size(data: bytes) -> tuple[int, int] | None:
    """Return (width, height) [px] as the frame header states them, 0 included; None if there is no such header."""
    for marker, place in _segments(data):
        if marker in _FRAME_MARKERS and len(data) >= place + 9:
            return int.from_bytes(data[place + 7 : place + 9]), int.from_bytes(data[place + 5 : place + 7])
    return None


def has_ended(data: bytes) -> bool:
    """Return whether a JPEG received so far is whole: it ends, and not just with a thumbnail in its head.

    WIRE: ITU-T T.81 B.1.1.5: behind the first scan the end marker stands at the end only.
    """
    return data.rstrip(b"\r\n").endswith(_END) and any(marker == _SCAN for marker, _ in _segments(data))


def whole_size(data: bytes) -> tuple[int, int] | None:
    """Return (width, height) [px] of a whole JPEG, or None when it is none or cut short."""
    size = stated_size(data)
    if size is None or 0 in size or not data.rstrip(b"\r\n\x00").endswith(_END):
        return None
    return size
