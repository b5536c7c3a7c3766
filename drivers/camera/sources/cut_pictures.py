"""H.264 pictures cut into unnumbered datagrams: after a full one the picture goes on, a shorter one ends it. Pure."""

from typing import NamedTuple

from drivers.camera.sources.nal_units import KEY_PICTURE, PICTURE, SEQUENCE_PARAMETERS, unit_types

# Larger than any picture of a small camera: the ends of several were lost.
_MOST_BYTES = 1 << 20


class AccessUnit(NamedTuple):
    """One picture with the parameter sets before it; starts: a decoder can begin here."""

    data: bytes
    starts: bool


class Assembly:
    """Datagrams to access units; whole_bytes: size of a full datagram. `skipped` counts bytes that belong to none."""

    def __init__(self, whole_bytes: int) -> None:
        self.skipped = 0
        self._whole_bytes = whole_bytes
        self._data = bytearray()

    def feed(self, datagram: bytes) -> AccessUnit | None:
        """Return the access unit that a datagram completes."""
        self._data += datagram
        if len(datagram) >= self._whole_bytes and len(self._data) <= _MOST_BYTES:
            return None
        data = bytes(self._data)
        kinds = set(unit_types(data))
        if not {PICTURE, KEY_PICTURE} & kinds and kinds and len(data) <= _MOST_BYTES:
            return None  # parameter sets, which go with the picture that follows
        self._data.clear()
        if not kinds or len(data) > _MOST_BYTES:
            self.skipped += len(data)
            return None
        return AccessUnit(data, KEY_PICTURE in kinds and SEQUENCE_PARAMETERS in kinds)
