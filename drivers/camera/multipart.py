"""Extracts JPEG frames from a multipart/x-mixed-replace byte stream; pure, bounded, never trusting the sender.

WIRE: RFC 2046 section 5.1 as IP cameras implement it: boundaries with and without leading dashes, parts with and
without Content-Length or with a wrong one, lines that end in LF alone, any number of blank lines between parts and
before pictures.
"""

import re

from drivers.camera.http_answer import HEAD_END, boundary_from_body, may_begin_with_boundary
from groundstation.bus.jpeg import has_ended
from groundstation.time_units import NS_PER_S

MAX_FRAME_BYTES = 8 << 20
_MAX_HEAD_BYTES = 4096
_MAX_BLANK_BYTES = 256
# A part that is not whole yet is searched for a boundary at this size, and whenever it has doubled.
_FIRST_LOOK_BYTES = 1 << 14
_LENGTH = re.compile(rb"^content-length:[ \t]*(\d{1,9})[ \t]*$", re.IGNORECASE | re.MULTILINE)
# WIRE: seconds of the camera's clock, as MJPG-streamer and the ESP32's examples send them.
_STAMP = re.compile(rb"^x-timestamp:[ \t]*(\d{1,10})(?:\.(\d{1,9}))?[ \t]*$", re.IGNORECASE | re.MULTILINE)
_JPEG_START, _JPEG_END = b"\xff\xd8", b"\xff\xd9"


class MultipartParser:
    """Takes the bytes of a body as they come; returns the complete JPEG frames in them.

    boundary: the announced one; a body that begins with another has that. `rejected` counts parts that are no JPEG, too
    long, or cut short; `stamps_ns`: the sender's times of the frames returned last, None where it sent none.
    """

    def __init__(self, boundary: bytes) -> None:
        self._mark = b"--" + boundary
        self._begun = False
        self._buffer = bytearray()
        self._needed = 0
        self._stamp_ns: int | None = None
        # Whether a length was wrong; whether pictures end without a JPEG's end mark although their length is right.
        self._doubted = self._bare = False
        self._end_within = re.compile(re.escape(_JPEG_END) + rb"[\r\n]*" + re.escape(self._mark))
        self.rejected = 0
        self.stamps_ns: list[int | None] = []

    def feed(self, data: bytes) -> list[bytes]:
        """Take in bytes; return the frames that are now complete, oldest first."""
        self._buffer += data
        self.stamps_ns = []
        if not self._begun and not self._begin():
            return []
        frames: list[bytes] = []
        while len(self._buffer) >= self._needed and self._step(frames):
            pass
        if len(self._buffer) > MAX_FRAME_BYTES + _MAX_HEAD_BYTES:
            self._reject(len(self._buffer) - len(self._mark))
        return frames

    def _begin(self) -> bool:
        """Take the boundary with which the body begins; False when more bytes are needed."""
        begun = bytes(self._buffer[:_MAX_HEAD_BYTES])
        if may_begin_with_boundary(begun):
            return False
        found = boundary_from_body(begun)
        self._mark = b"--" + found if found else self._mark
        self._end_within = re.compile(re.escape(_JPEG_END) + rb"[\r\n]*" + re.escape(self._mark))
        self._begun = True
        return True

    def _step(self, frames: list[bytes]) -> bool:
        """Consume one part; False when more bytes are needed."""
        self._needed = 0
        start = self._buffer.find(self._mark)
        if start < 0:
            # Noise between parts: keep only what may be the beginning of a boundary.
            del self._buffer[: max(0, len(self._buffer) - len(self._mark) + 1)]
            return False
        head_start = start + len(self._mark)
        head = HEAD_END.search(self._buffer, head_start, head_start + _MAX_HEAD_BYTES)
        if head is None:
            if len(self._buffer) - head_start > _MAX_HEAD_BYTES:
                self._reject(head_start)
                return True
            return False
        return self._take_body(head_start, head, frames)

    def _take_body(self, head_start: int, head: re.Match[bytes], frames: list[bytes]) -> bool:
        lines = bytes(self._buffer[head_start : head.start()]).replace(b"\r\n", b"\n")
        self._stamp_ns = _stamp_ns(lines)
        length, body = _LENGTH.search(lines), head.end()
        if length is not None and (taken := self._take_sized(body, body + int(length[1]), frames)) is not None:
            return taken
        end = self._buffer.find(self._mark, body)
        if end < 0:
            self._take_ended(body, frames)
            return False
        self._emit(bytes(self._buffer[body:end]).rstrip(b"\r\n-"), end, frames)
        return True

    def _take_sized(self, body: int, end: int, frames: list[bytes]) -> bool | None:
        """Take a part by its stated length; None if that is wrong, or that of another part was."""
        has_come = len(self._buffer) >= end
        if has_come and (self._bare or _ends_as_jpeg(self._buffer[body:end])):
            self._emit(bytes(self._buffer[body:end]), end, frames)
            return True
        if self._doubted or end - body > MAX_FRAME_BYTES:
            self._doubted = True
            return None
        if not has_come:
            self._doubted = self._end_within.search(self._buffer, body) is not None
            self._needed = 0 if self._doubted else min(end, max(2 * len(self._buffer), _FIRST_LOOK_BYTES))
            return None if self._doubted else False
        behind = bytes(self._buffer[end : end + _MAX_BLANK_BYTES]).lstrip(b"\r\n")
        if len(behind) < len(self._mark) and self._mark.startswith(behind):
            return False
        if not behind.startswith(self._mark):
            self._doubted = True
            return None
        self._bare = self._buffer.startswith(_JPEG_START, body)
        self._emit(bytes(self._buffer[body:end]), end, frames)
        return True

    def _take_ended(self, body: int, frames: list[bytes]) -> None:
        """Take a picture that has ended although its boundary is missing: that may come with the next picture."""
        if self._buffer[-4:].rstrip(b"\r\n").endswith(_JPEG_END) and has_ended(data := bytes(self._buffer[body:])):
            self._emit(data.rstrip(b"\r\n"), len(self._buffer), frames)

    def _emit(self, body: bytes, end: int, frames: list[bytes]) -> None:
        body = body.lstrip(b"\r\n")
        if body.startswith(_JPEG_START):
            frames.append(body)
            self.stamps_ns.append(self._stamp_ns)
            del self._buffer[:end]
        else:
            self._reject(end)

    def _reject(self, upto: int) -> None:
        self.rejected += 1
        self._needed = 0
        del self._buffer[:upto]


def _ends_as_jpeg(body: bytearray) -> bool:
    return body.rstrip(b"\r\n").endswith(_JPEG_END)


def _stamp_ns(lines: bytes) -> int | None:
    stamp = _STAMP.search(lines)
    return None if stamp is None else int(stamp[1]) * NS_PER_S + int((stamp[2] or b"0").ljust(9, b"0"))
