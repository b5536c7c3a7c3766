"""Units of an H.264 byte stream (Annex B), by their types. Pure."""

from collections.abc import Iterator

PICTURE, KEY_PICTURE, SEQUENCE_PARAMETERS, PICTURE_PARAMETERS, DELIMITER = 1, 5, 7, 8, 9
_START_CODE = b"\x00\x00\x01"


def unit_heads(data: bytes, size: int) -> Iterator[bytes]:
    """Yield the first bytes, at most that many, of each unit in a piece of a stream, in order."""
    begin = data.find(_START_CODE)
    while 0 <= begin < len(data) - len(_START_CODE):
        begin += len(_START_CODE)
        end = data.find(_START_CODE, begin)
        yield data[begin : begin + size if end < 0 else min(begin + size, end)]
        begin = end


def unit_types(data: bytes) -> Iterator[int]:
    """Yield the types of the units in a piece of a stream, in order."""
    return (head[0] & 0x1F for head in unit_heads(data, 1) if head)


def has_parameters(data: bytes) -> bool:
    """Return whether an access unit begins with its own sequence parameters, as a decoder needs them."""
    for kind in unit_types(data):
        if kind == SEQUENCE_PARAMETERS:
            return True
        if kind in (PICTURE, KEY_PICTURE):
            return False
    return False


def begins_picture(data: bytes) -> bool:
    """Return whether a piece of a stream begins with what comes before a picture, or with its first slice."""
    if not data.startswith((_START_CODE, b"\0" + _START_CODE)):
        return False
    head = next(unit_heads(data, 2), b"")
    kind = head[0] & 0x1F if head else 0
    # WIRE (H.264, 7.3.3): a slice begins with first_mb_in_slice; a bit 1 alone is 0.
    first = kind in (PICTURE, KEY_PICTURE) and head[1:2] >= b"\x80"
    return first or kind in (SEQUENCE_PARAMETERS, PICTURE_PARAMETERS, DELIMITER)
