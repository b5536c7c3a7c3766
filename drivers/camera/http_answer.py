"""The answer of an HTTP camera: its head, the stream's properties, and bodies sent in chunks. Pure.

WIRE: RFC 9112 sections 5 to 7. Cameras on an ESP32 and ffmpeg send chunks even to a client that speaks HTTP/1.0.
"""

import re

from groundstation.errors import DriverError

# Of an answer, and of each part of a stream.
HEAD_END = re.compile(rb"\r?\n\r?\n")
_CHUNKED = re.compile(rb"^transfer-encoding:[^\r\n]*\bchunked\b", re.IGNORECASE | re.MULTILINE)
_BOUNDARY = re.compile(rb"multipart/[a-z-]+[^\r\n]*boundary=\"?([^\r\n\";]+)", re.IGNORECASE)
# A line of dashes counts only before a part's head: anything may begin so.
_FIRST_LINES = re.compile(rb"[\r\n]*--([ -~]{1,70})\r?\n[A-Za-z-]+:")
_LOCATION = re.compile(rb"^location:[ \t]*([!-~]{1,200})", re.IGNORECASE | re.MULTILINE)
_SIZE = re.compile(rb"[ \t]*([0-9a-fA-F]{1,8})[ \t]*(;.*)?")
_MAX_LINE_BYTES = 256


def split_answer(data: bytes) -> tuple[bytes, bytes] | None:
    """Return the head and the bytes behind it, or None while the head has not ended."""
    end = HEAD_END.search(data)
    return None if end is None else (data[: end.start()], data[end.end() :])


def location_of(head: bytes) -> str:
    """Return the address to which an answer refers, or ""."""
    match = _LOCATION.search(head)
    return match[1].decode("ascii") if match else ""


def is_chunked(head: bytes) -> bool:
    """Return whether the body is sent in chunks."""
    return _CHUNKED.search(head) is not None


def boundary_from_head(head: bytes) -> bytes | None:
    """Return the boundary that a response head announces, without leading dashes, or None."""
    match = _BOUNDARY.search(head)
    return match[1].strip().lstrip(b"-") if match else None


def boundary_from_body(body: bytes) -> bytes | None:
    """Return the boundary with which a body begins, without leading dashes; None if it begins with none, or not yet."""
    match = _FIRST_LINES.match(body)
    return match[1].strip().lstrip(b"-") if match else None


def may_begin_with_boundary(body: bytes) -> bool:
    """Return whether more bytes may show that a body begins with a boundary."""
    lines = body.lstrip(b"\r\n")
    return b"--".startswith(lines[:2]) and lines.count(b"\n") < 2 and len(body) < _MAX_LINE_BYTES


class ChunkedBody:
    """Takes the bytes of a body sent in chunks as they come; returns those that it carries. `ended`: it has no more."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._left = 0
        self.ended = False

    def feed(self, data: bytes) -> bytes:
        """Take in bytes; return those of the body; raises DriverError where a chunk has no size."""
        self._buffer += data
        body = bytearray()
        while self._buffer and not self.ended and self._step(body):
            pass
        return bytes(body)

    def _step(self, body: bytearray) -> bool:
        """Consume one line, or the present part of a chunk; False when more bytes are needed."""
        if self._left:
            part = self._buffer[: self._left]
            body += part
            self._left -= len(part)
            del self._buffer[: len(part)]
            return True
        end = self._buffer.find(b"\n", 0, _MAX_LINE_BYTES)
        if end < 0 and len(self._buffer) < _MAX_LINE_BYTES:
            return False
        line = bytes(self._buffer[:end]).strip() if end >= 0 else b"-"
        del self._buffer[: end + 1]
        if line:  # an empty one ends the chunk before
            self._begin(line)
        return True

    def _begin(self, line: bytes) -> None:
        match = _SIZE.fullmatch(line)
        if match is None:
            raise DriverError("the camera's answer is damaged: a chunk without a size")
        self._left = int(match[1], 16)
        self.ended = not self._left
