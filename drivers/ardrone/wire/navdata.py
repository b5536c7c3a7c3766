"""Navdata packets: header, options, checksum.

Options are kept as raw payloads, so that encoding a decoded packet gives the same bytes; `Navdata.read` decodes the
requested ones. Unknown tags are skipped by their size.
"""

import struct
from typing import Any, NamedTuple, TypeVar
from zlib import adler32

from drivers.ardrone.wire.errors import WireError
from drivers.ardrone.wire.layout import OptionLayout
from drivers.ardrone.wire.tags import Tag

MAGIC = 0x55667788
MAX_SIZE = 4096  # WIRE: the SDK's receive buffer
# WIRE: any datagram to port 5554 asks for unicast navdata; the SDK sends int32 1.
REQUEST = b"\x01\x00\x00\x00"

_BLOCK = 256  # bytes: 256 * 255 < 65521
_HEADER = struct.Struct("<IIII")
_OPTION = struct.Struct("<HH")
_CHECKSUM = struct.Struct("<HHI")
_CHECKSUM_TAG = int(Tag.CHECKSUM)  # an int: asking an enum for its member takes longer than an option does
# WIRE: listed by node-ar-drone as an alternative magic.
_MAGICS = (MAGIC, 0x55667789)

Options = tuple[tuple[int, bytes], ...]
Value = TypeVar("Value", bound=tuple[Any, ...])


class Navdata(NamedTuple):
    """One packet; options are (tag, payload) in wire order, without the checksum."""

    state: int
    sequence: int
    vision_defined: int = 0
    options: Options = ()
    magic: int = MAGIC

    def read(self, layout: OptionLayout[Value]) -> Value | None:
        """Return an option's value, or None when the packet's firmware does not send it.

        Raises WireError (option_size) when it is there but shorter than the layout.
        """
        options, number = self.options, layout.number
        # A full packet holds all options from 0 on, so no search is needed.
        if number < len(options) and options[number][0] == number:
            payload = options[number][1]
        else:
            found = next((payload for tag, payload in options if tag == number), None)
            if found is None:
                return None
            payload = found
        return layout.read(payload)


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
    return Navdata(state, sequence, vision_defined, options, magic)


class _Cut:
    """The division of a packet into options, by which the next one of that length is divided in a third of the time.

    Its fields are tag, size and payload of each option, then tag and size of the checksum.
    """

    def __init__(self, options: Options, end: int, checksum_size: int) -> None:
        self.tags = (*(tag for tag, _ in options), _CHECKSUM_TAG)
        self.sizes = (*(len(payload) + _OPTION.size for _, payload in options), checksum_size)
        fields = "".join(f"HH{len(payload)}s" for _, payload in options)
        self._struct = struct.Struct(f"<{_HEADER.size}x{fields}HH")
        self.end = end

    def options(self, datagram: bytes) -> Options | None:
        """Return the options of a packet, or None if it is divided differently."""
        fields = self._struct.unpack_from(datagram)
        if fields[0::3] != self.tags or fields[1::3] != self.sizes:
            return None
        return tuple(zip(self.tags, fields[2::3], strict=False))


_cuts: dict[int, _Cut] = {}


def _decode_options(datagram: bytes) -> tuple[Options, int]:
    # Returns the options and the offset of the checksum option, or -1 without one.
    cut = _cuts.get(len(datagram))
    if cut is not None and (options := cut.options(datagram)) is not None:
        return options, cut.end
    options, end = _walk(datagram)
    if cut is None and len(datagram) - end >= _CHECKSUM.size and end > 0:
        _cuts[len(datagram)] = _Cut(options, end, _OPTION.unpack_from(datagram, end)[1])
    return options, end


def _walk(datagram: bytes) -> tuple[Options, int]:
    options: list[tuple[int, bytes]] = []
    offset, total = _HEADER.size, len(datagram)
    unpack, head = _OPTION.unpack_from, _OPTION.size
    while offset < total:
        if total - offset < head:
            raise WireError("truncated", f"{total - offset} bytes left of an option")
        tag, size = unpack(datagram, offset)
        end = offset + size
        # WIRE: a size of 0 made real clients loop for ever (ardrone_autonomy #69).
        if size < head or end > total:
            reason = "option_size" if size < head else "truncated"
            raise WireError(reason, f"option {tag} says {size} bytes, {total - offset} left")
        if tag == _CHECKSUM_TAG:
            return tuple(options), offset
        options.append((tag, datagram[offset + head : end]))
        offset = end
    return tuple(options), -1


def _check(datagram: bytes, offset: int, strict: bool) -> None:
    size = _OPTION.unpack_from(datagram, offset)[1]
    if size < _CHECKSUM.size:
        raise WireError("option_size", f"checksum option says {size} bytes")
    if strict and offset + size != len(datagram):
        raise WireError("trailing_bytes", f"{len(datagram) - offset - size} after the checksum")
    stored = _CHECKSUM.unpack_from(datagram, offset)[2]
    computed = checksum(datagram, offset)
    if stored != computed:
        raise WireError("checksum", f"stored {stored}, computed {computed}")


def checksum(data: bytes, end: int | None = None) -> int:
    """Return the plain sum of all bytes, or of those before `end`."""
    summed, total = data[:end], 0
    # The low half of an Adler-32 from 0 on is the sum modulo 65521, which a block cannot reach: faster than sum().
    for at in range(0, len(summed), _BLOCK):
        total += adler32(summed[at : at + _BLOCK], 0) & 0xFFFF
    return total


def encode(navdata: Navdata) -> bytes:
    """Return the packet with its checksum; raises WireError (value) for fields that do not fit."""
    try:
        parts = [_HEADER.pack(navdata.magic, navdata.state, navdata.sequence, navdata.vision_defined)]
        for tag, payload in navdata.options:
            parts += (_OPTION.pack(tag, len(payload) + 4), payload)
    except struct.error as error:
        raise WireError("value", str(error)) from error
    body = b"".join(parts)
    return body + _CHECKSUM.pack(_CHECKSUM_TAG, _CHECKSUM.size, checksum(body))
