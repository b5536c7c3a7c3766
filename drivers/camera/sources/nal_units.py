"""Units of an H.264 byte stream (Annex B), by their types. Pure."""

from collections.abc import Iterator

SEQUENCE_PARAMETERS, PICTURE, KEY_PICTURE = 7, 1, 5
_START_CODE = b"\x00\x00\x01"


def unit_types(data: bytes) -> Iterator[int]:
    """Yield the types of the units in a piece of a stream, in order."""
    place = data.find(_START_CODE)
    while 0 <= place < len(data) - len(_START_CODE):
        yield data[place + len(_START_CODE)] & 0x1F
        place = data.find(_START_CODE, place + len(_START_CODE))


def has_parameters(data: bytes) -> bool:
    """Return whether an access unit begins with its own sequence parameters, as a decoder needs them."""
    for kind in unit_types(data):
        if kind == SEQUENCE_PARAMETERS:
            return True
        if kind in (PICTURE, KEY_PICTURE):
            return False
    return False
