"""Finds frames in a stream of bytes that may begin, end and break anywhere. Pure."""

from drivers.mavlink.links.datagram_cutter import next_start, size_at
from drivers.mavlink.wire.signature import MAGIC
from drivers.mavlink.wire.verification import is_whole


class StreamCutter:
    """Cuts a stream. Any byte may look like the beginning of a frame: only the right checksum shows that it is one.

    Returns frames of MAVLink 1 with the right checksum, and all of MAVLink 2, so that the receiver counts the wrong.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._in_step = False  # a right frame ended where the buffer begins

    def feed(self, data: bytes) -> list[bytes]:
        """Return the frames that are complete by now; bytes that belong to none are skipped."""
        buffer, frames = self._buffer, []
        buffer += data
        while buffer:
            size = size_at(buffer, 0)
            if len(buffer) < size:
                if (right := self._next_right()) is None:
                    break
                del buffer[:right]
                continue
            frame = bytes(buffer[:size])
            self._in_step = size > 0 and is_whole(frame)
            if self._in_step or frame[:1] == bytes([MAGIC]):
                frames.append(frame)
            # Behind a false start the search goes on at once: a true frame may begin within it.
            del buffer[: size if self._in_step else next_start(buffer, 1)]
        return frames

    def _next_right(self) -> int | None:
        """Return where frames with the right checksum go on, if the buffer begins with a false start.

        That might wait for 268 bytes. In step, one within its bytes may be its content: then it takes two in a row.
        """
        at = 0
        while (at := next_start(self._buffer, at + 1)) < len(self._buffer):
            size = self._right_at(at)
            if size and (not self._in_step or self._right_at(at + size)):
                return at
        return None

    def _right_at(self, at: int) -> int:
        """Return the length of a whole frame with the right checksum, 0 if there is none."""
        size = size_at(self._buffer, at) if at < len(self._buffer) else 0
        whole = 0 < size <= len(self._buffer) - at and is_whole(bytes(self._buffer[at : at + size]))
        return size if whole else 0
