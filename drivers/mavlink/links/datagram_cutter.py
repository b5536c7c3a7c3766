"""Finds frames in datagrams that break them anywhere, as those of a transparent serial bridge do. Pure."""

import re
from collections.abc import Callable

from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.signature import CHECKSUM, HEADER, MAGIC_1, SIGNATURE, frame_size, old_frame_size
from drivers.mavlink.wire.verification import is_whole
from groundstation.adapters import Address
from groundstation.time_units import NS_PER_S

_KEPT_NS, _SOURCES = NS_PER_S, 64
# So many bytes that look like a beginning are tried in a datagram: it costs no more than one full of frames.
_FALSE_STARTS = 32
_LONGEST = HEADER + 255 + CHECKSUM + SIGNATURE
_START = re.compile(rb"[\xfd\xfe]")


class DatagramCutter:
    """Cuts datagrams of many sources; a frame without its end waits 1 s for the next datagram of its source.

    Frames that follow each other from the first byte on are returned unchecked. A frame of two datagrams, or behind
    bytes that are none, needs the right checksum: any byte may look like its beginning.
    reject: called with the reason and the details of each refusal.
    """

    def __init__(self, reject: Callable[[str, str], None]) -> None:
        self._reject = reject
        self._begun: dict[Address, tuple[int, bytes]] = {}  # the oldest first

    def take(self, now_ns: int, data: bytes, source: Address) -> list[bytes]:
        """Return the frames of MAVLink 1 and 2 that end in a datagram."""
        while self._begun and now_ns - next(iter(self._begun.values()))[0] > _KEPT_NS:
            self._give_up(next(iter(self._begun)))
        frames, rest = self._completed(data, source) if source in self._begun else self._cut(data, in_step=True)
        if rest:
            self._begun[source] = now_ns, rest
            if len(self._begun) > _SOURCES:
                self._give_up(next(iter(self._begun)))
        return frames

    def _completed(self, data: bytes, source: Address) -> tuple[list[bytes], bytes]:
        """Return the frames of a datagram behind an unfinished frame, and the bytes of the next one."""
        joined = self._begun[source][1] + data
        if _begins_whole(joined) and not _begins_whole(data):
            del self._begun[source]
            return self._cut(joined, in_step=True)
        if not _begins_whole(data) and size_at(joined, 0) > len(joined):
            del self._begun[source]
            return [], joined
        self._give_up(source)  # the datagram between the two was lost
        return self._cut(data, in_step=True) if _begins_whole(data) else self._cut(joined[1:], in_step=False)

    def _cut(self, data: bytes, in_step: bool) -> tuple[list[bytes], bytes]:
        """Return the frames, and the bytes of one that has no end yet."""
        frames, begun, offset, false_starts = list[bytes](), len(data), 0, 0
        while offset < len(data):
            size = size_at(data, offset)
            raw = data[offset : offset + size]
            if in_step and size > len(raw):
                return frames, raw
            if raw and size == len(raw) and (in_step or is_whole(raw)):
                frames.append(raw)
                in_step, begun, offset = True, len(data), offset + size
                continue
            if in_step:
                self._refuse(data, offset)
            elif size > len(raw):
                begun = min(begun, offset)
            if (false_starts := false_starts + 1) > _FALSE_STARTS:
                return frames, b""
            in_step, offset = False, next_start(data, offset + 1)
        return frames, data[begun:]

    def _refuse(self, data: bytes, offset: int) -> None:
        try:
            frame_size(data, offset)
        except WireError as error:
            self._reject(error.reason, str(error))

    def _give_up(self, source: Address) -> None:
        _, begun = self._begun.pop(source)
        self._reject("truncated", f"{len(begun)} bytes from {source[0]}:{source[1]}")


def size_at(data: bytes | bytearray, offset: int) -> int:
    """Return the length of the frame that begins at an offset; the longest possible if its header is cut; or 0."""
    try:
        return old_frame_size(data, offset) if data[offset] == MAGIC_1 else frame_size(data, offset)
    except WireError as error:
        return _LONGEST if error.reason == "truncated" else 0


def _begins_whole(data: bytes) -> bool:
    size = size_at(data, 0) if data else 0
    return 0 < size <= len(data) and is_whole(data[:size])


def next_start(data: bytes | bytearray, offset: int) -> int:
    """Return where a byte that may begin a frame is next, the end if nowhere."""
    found = _START.search(data, offset)
    return found.start() if found else len(data)
