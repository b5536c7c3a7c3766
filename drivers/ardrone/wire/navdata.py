"""Navdata packets: header, options, checksum.

Options are kept as raw payloads, so that encoding a decoded packet gives the same bytes; `Navdata.read` interprets the
ones that are asked for. Unknown tags are skipped by their size.
"""

import struct
from dataclasses import dataclass
from typing import Any, TypeVar

from drivers.ardrone.wire.errors import WireError
from drivers.ardrone.wire.layout import OptionLayout
from drivers.ardrone.wire.tags import Tag

MAGIC = 0x55667788
MAX_SIZE = 4096  # WIRE: the SDK's receive buffer
# WIRE: any datagram to port 5554 asks for unicast navdata; the SDK sends int32 1.
REQUEST = b"\x01\x00\x00\x00"

_HEADER = struct.Struct("<IIII")
_OPTION = struct.Struct("<HH")
_CHECKSUM = struct.Struct("<HHI")
# WIRE: listed by node-ar-drone as an alternative magic.
_MAGICS = (MAGIC, 0x55667789)

Value = TypeVar("Value", bound=tuple[Any, ...])


@dataclass(frozen=True, slots=True)
class Navdata:
    """One packet; options are (tag, payload) in wire order, without the checksum."""

    state: int
    sequence: int
    vision_defined: int = 0
    options: tuple[tuple[int, bytes], ...] = ()
    magic: int = MAGIC

    def read(self, layout: OptionLayout[Value]) -> Value | None:
        """Return an option's value, or None when the packet's firmware does not send it.

        Raises WireError (option_size) when it is there but shorter than the layout.
        """
        options, number = self.options, layout.number
        # A full packet holds all options from 0 on: nothing to search for.
        if number < len(options) and options[number][0] == number:
            payload = options[number][1]
        else:
            found = next((payload for tag, payload in options if tag == number), None)
            if found is None:
                return None
            payload = found
        return layout.decode(payload) if layout.is_in(payload) else None


def decode(datagram: bytes, strict: bool = True) -> Navdata:
    """Return the packet in a datagram.

    Raises WireError: too_short, too_long, magic, option_size, truncated, checksum; and when strict also
    checksum_missing and trailing_bytes.
    """
    if len(datagram) < _HEADER.size:
        raise WireError("too_short", f"{len(datagram)} bytes")
    if len(datagram) > MAX_SIZE:
        raise WireError("too_long", f"{len(datagram)} bytes")
    magic, state, sequence, vision_defined = _HEADER.unpack_from(datagram)
    if magic not in _MAGICS:
        raise WireError("magic", f"{magic:08x}")
    options, end = _decode_options(datagram)
    if end < 0:
        if strict:
            raise WireError("checksum_missing")
    else:
        _check(datagram, end, strict)
    return Navdata(state, sequence, vision_defined, tuple(options), magic)


def _decode_options(datagram: bytes) -> tuple[list[tuple[int, bytes]], int]:
    # Returns the options and the offset of the checksum option, or -1 without one.
    options: list[tuple[int, bytes]] = []
    offset, total = _HEADER.size, len(datagram)
    unpack = _OPTION.unpack_from
    while offset < total:
        if total - offset < _OPTION.size:
            raise WireError("truncated", f"{total - offset} bytes left of an option")
        tag, size = unpack(datagram, offset)
        # WIRE: a size of 0 made real clients loop for ever (ardrone_autonomy #69).
        if size < _OPTION.size:
            raise WireError("option_size", f"option {tag} says {size} bytes")
        end = offset + size
        if end > total:
            raise WireError("truncated", f"option {tag} says {size} bytes, {total - offset} left")
        if tag == Tag.CHECKSUM:
            return options, offset
        options.append((tag, datagram[offset + 4 : end]))
        offset = end
    return options, -1


def _check(datagram: bytes, offset: int, strict: bool) -> None:
    size = _OPTION.unpack_from(datagram, offset)[1]
    if size < _CHECKSUM.size:
        raise WireError("option_size", f"checksum option says {size} bytes")
    if strict and offset + size != len(datagram):
        raise WireError("trailing_bytes", f"{len(datagram) - offset - size} after the checksum")
    stored = _CHECKSUM.unpack_from(datagram, offset)[2]
    computed = checksum(datagram[:offset])
    if stored != computed:
        raise WireError("checksum", f"stored {stored}, computed {computed}")


def checksum(data: bytes) -> int:
    """Return the plain sum of all bytes."""
    return sum(data)


def encode(navdata: Navdata) -> bytes:
    """Return the packet with its checksum; raises WireError (value) for fields that do not fit."""
    try:
        parts = [_HEADER.pack(navdata.magic, navdata.state, navdata.sequence, navdata.vision_defined)]
        for tag, payload in navdata.options:
            parts += (_OPTION.pack(tag, len(payload) + 4), payload)
    except struct.error as error:
        raise WireError("value", str(error)) from error
    body = b"".join(parts)
    return body + _CHECKSUM.pack(Tag.CHECKSUM, _CHECKSUM.size, checksum(body))
