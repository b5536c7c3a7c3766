"""Finds frames in a stream of bytes that may begin, end and break anywhere. Pure."""

from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.signature import frame_size


class StreamCutter:
    """Finds frames in a stream of bytes that may begin, end and break anywhere."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """Return the frames that are complete by now; bytes that belong to none are skipped."""
        buffer, frames = self._buffer, []
        buffer += data
        while len(buffer) >= 3:
            try:
                size = frame_size(buffer)
            except WireError:
                del buffer[0]
                continue
            if len(buffer) < size:
                break
            frames.append(bytes(buffer[:size]))
            # A false start may hide a true frame: only a confirmed checksum lets a whole frame be skipped, by the
            # caller's count of refusals; at most one frame is lost with it.
            del buffer[:size]
        return frames
