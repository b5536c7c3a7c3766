"""H.264 pictures cut into unnumbered datagrams: a shorter one ends the picture, or the beginning of the next. Pure."""

from typing import NamedTuple

from drivers.camera.sources.nal_units import KEY_PICTURE, PICTURE, SEQUENCE_PARAMETERS, begins_picture, unit_types

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

    def feed(self, datagram: bytes) -> list[AccessUnit]:
        """Return the access units that a datagram completes, oldest first."""
        # The last datagram of a picture is as large as the others when its size happens to be a multiple of theirs.
        done = self._ended() if self._data and begins_picture(datagram) else []
        self._data += datagram
        if len(datagram) < self._whole_bytes or len(self._data) > _MOST_BYTES:
            done += self._ended()
        return done

    def _ended(self) -> list[AccessUnit]:
        """Return the picture that all bytes so far are; parameter sets go with the picture that follows."""
        data = bytes(self._data)
        kinds = set(unit_types(data))
        if not {PICTURE, KEY_PICTURE} & kinds and kinds and len(data) <= _MOST_BYTES:
            return []
        self._data.clear()
        if not kinds or len(data) > _MOST_BYTES:
            self.skipped += len(data)
            return []
        return [AccessUnit(data, KEY_PICTURE in kinds and SEQUENCE_PARAMETERS in kinds)]
