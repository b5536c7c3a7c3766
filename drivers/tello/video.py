"""A Tello's own video (`tello://ADDRESS`), which comes once the driver has requested it."""

from drivers.camera.sources.datagrams import DatagramReader
from drivers.tello.wire.text import VIDEO_PORT

# WIRE (docs/reference/tello.md 4): a picture fills datagrams of this size; a shorter one is its last.
WHOLE_BYTES = 1460


class TelloReader(DatagramReader):
    """The pictures of one Tello."""

    def __init__(self, address: tuple[str, int], interface: str = "") -> None:
        super().__init__(address[0], interface, VIDEO_PORT, WHOLE_BYTES)
