"""CDR, the bytes of a ROS 2 message, read and written value by value.

WIRE (docs/reference/ros2.md 1): numbers are aligned to their size, counted from behind the 4 bytes of the
encapsulation; texts and sequences begin with their length, a text's counts its final zero.
"""

import struct
from typing import Any, Self

_ENCAPSULATION = 4
_LITTLE_ENDIAN = b"\x00\x01\x00\x00"


class WireError(ValueError):
    """Bytes that are no valid message; reason: a word to count them by."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


class CdrReader:
    """The values of one message in their order; every method raises WireError("short") where the message ends."""

    def __init__(self, payload: bytes) -> None:
        if len(payload) < _ENCAPSULATION:
            raise WireError("short")
        if payload[0] or payload[1] > 1:
            raise WireError("encapsulation")
        self._order = "<" if payload[1] else ">"
        self._content, self._at = memoryview(payload)[_ENCAPSULATION:], 0

    def numbers(self, code: str, count: int = 1) -> tuple[Any, ...]:
        """Return numbers of one type (a letter of `struct`)."""
        size = struct.calcsize(code)
        at = self._at + -self._at % size
        try:
            values = struct.unpack_from(f"{self._order}{count}{code}", self._content, at)
        except struct.error:
            raise WireError("short") from None
        self._at = at + count * size
        return values

    def text(self) -> str:
        """Return a text; bytes that are not UTF-8 are replaced."""
        return self.blob().rstrip(b"\0").decode("utf-8", "replace")

    def blob(self) -> bytes:
        """Return a sequence of bytes."""
        (length,) = self.numbers("I")
        if length > len(self._content) - self._at:
            raise WireError("short")
        begin, self._at = self._at, self._at + length
        return bytes(self._content[begin : self._at])

    def header(self) -> tuple[int, str]:
        """Return Unix time [ns] and frame of a std_msgs/Header."""
        seconds, nanoseconds = *self.numbers("i"), *self.numbers("I")
        return seconds * 1_000_000_000 + nanoseconds, self.text()


class CdrWriter:
    """Writes the values of one message, little endian; `payload` is the message so far."""

    def __init__(self) -> None:
        self._content = bytearray()

    @property
    def payload(self) -> bytes:
        """Return the message with its encapsulation."""
        return _LITTLE_ENDIAN + bytes(self._content)

    def numbers(self, code: str, *values: float) -> Self:
        """Add numbers of one type (a letter of `struct`)."""
        size = struct.calcsize(code)
        self._content += bytes(-len(self._content) % size)
        self._content += struct.pack(f"<{len(values)}{code}", *values)
        return self

    def text(self, text: str) -> Self:
        """Add a text."""
        return self.blob(text.encode() + b"\0")

    def blob(self, data: bytes) -> Self:
        """Add a sequence of bytes."""
        self.numbers("I", len(data))
        self._content += data
        return self

    def header(self, stamp_ns: int, frame: str) -> Self:
        """Add a std_msgs/Header: Unix time [ns] and frame."""
        seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
        return self.numbers("i", seconds).numbers("I", nanoseconds).text(frame)
