"""Whether a JPEG is whole, and its size: a picture of absurd size is refused before it takes the memory."""

from groundstation.bus.jpeg import stated_size

_END = b"\xff\xd9"


def size_of(data: bytes) -> tuple[int, int] | None:
    """Return (width, height) [px] of a whole JPEG, or None when it is none or cut short."""
    size = stated_size(data)
    if size is None or 0 in size or not data.rstrip(b"\r\n\x00").endswith(_END):
        return None
    return size
