"""The size of a JPEG from its head alone, so that it can be refused before it is decoded."""

_START = b"\xff\xd8"
_END = b"\xff\xd9"
# WIRE: ITU-T T.81 table B.1: start of frame, all kinds but the tables (C4, C8, CC) between them.
_FRAME_MARKERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_STANDALONE = frozenset({0x01, *range(0xD0, 0xD8)})
_MOST_SEGMENTS = 200


def stated_size(data: bytes) -> tuple[int, int] | None:
    """Return (width, height) [px] as the frame header states them, 0 included; None where there is no such header."""
    if not data.startswith(_START):
        return None
    place = len(_START)
    for _ in range(_MOST_SEGMENTS):
        while data[place : place + 2] == b"\xff\xff":  # fill bytes
            place += 1
        if len(data) < place + 9 or data[place] != 0xFF:
            return None
        marker = data[place + 1]
        if marker in _FRAME_MARKERS:
            return int.from_bytes(data[place + 7 : place + 9]), int.from_bytes(data[place + 5 : place + 7])
        place += 2 if marker in _STANDALONE else 2 + int.from_bytes(data[place + 2 : place + 4])
    return None


def whole_size(data: bytes) -> tuple[int, int] | None:
    """Return (width, height) [px] of a whole JPEG, or None when it is none or cut short."""
    size = stated_size(data)
    if size is None or 0 in size or not data.rstrip(b"\r\n\x00").endswith(_END):
        return None
    return size
