"""Lost pictures of an H.264 stream, by the numbers that its slices carry (frame_num). Pure.

Streams that cannot be read so far, or that leave out numbers on purpose, are trusted.
"""

from typing import NamedTuple

from drivers.camera.sources.nal_units import (
    KEY_PICTURE,
    PICTURE,
    PICTURE_PARAMETERS,
    SEQUENCE_PARAMETERS,
    unit_heads,
)

# Enough for parameters with all their scaling lists.
_HEAD_BYTES = 512
# WIRE (H.264, 7.3.2.1.1): profiles whose parameters name a format of colours.
_WITH_FORMAT = frozenset({100, 110, 122, 244, 44, 83, 86, 118, 128, 138, 139, 134, 135})
_SEPARATE_COLOURS = 3
_MOST_ZEROS = 32


class _Numbering(NamedTuple):
    """How a sequence numbers its pictures: bits of a number, and whether it may leave out numbers."""

    bits: int
    may_be_left_out: bool
    separate_colours: bool


class PictureNumbers:
    """Follows the numbers of one stream from a key picture on."""

    def __init__(self) -> None:
        self._sequences: dict[int, _Numbering | None] = {}
        self._sequence_of: dict[int, int] = {}
        self._last: int | None = None

    def begin(self) -> None:
        """Forget the last number: the next picture needs none before it."""
        self._last = None

    def follows(self, data: bytes) -> bool:
        """Take in an access unit (Annex B); return False if a picture is missing to which it may refer."""
        follows = True
        for head in unit_heads(data, _HEAD_BYTES):
            try:
                follows &= self._take(head)
            except IndexError:  # cut short: whether it is damaged is for the decoder to say
                self._sequences.clear()
        return follows

    def _take(self, head: bytes) -> bool:
        kind, is_reference = head[0] & 0x1F, bool(head[0] & 0x60)
        bits = _Bits(head[1:])
        if kind == SEQUENCE_PARAMETERS:
            identity, numbering = _numbering(bits)
            self._sequences[identity] = numbering
        elif kind == PICTURE_PARAMETERS:
            identity = bits.golomb()
            self._sequence_of[identity] = bits.golomb()
        elif kind in (PICTURE, KEY_PICTURE):
            return self._take_slice(bits, kind == KEY_PICTURE, is_reference)
        return True

    def _take_slice(self, bits: "_Bits", is_key: bool, is_reference: bool) -> bool:
        bits.golomb()  # first_mb_in_slice
        bits.golomb()  # slice_type
        numbering = self._sequences.get(self._sequence_of.get(bits.golomb(), -1))
        if numbering is None:
            self._last = None
            return True
        bits.number(2 if numbering.separate_colours else 0)
        number, last = bits.number(numbering.bits), self._last
        if is_key or is_reference:
            self._last = number
        if is_key or last is None or numbering.may_be_left_out:
            return True
        # WIRE (H.264, 7.4.3): one more than that of the last reference, or the same in its other slices and field.
        return (number - last) % (1 << numbering.bits) <= 1


class _Bits:
    """Reads the fields of a unit; raises IndexError behind its end."""

    def __init__(self, data: bytes) -> None:
        # WIRE (H.264, 7.4.1): a 3 behind two zeros only prevents start codes.
        self._data = data.replace(b"\0\0\3", b"\0\0")
        self._place = 0

    def number(self, bits: int) -> int:
        value = 0
        for _ in range(bits):
            value = value << 1 | self._data[self._place >> 3] >> (7 - self._place % 8) & 1
            self._place += 1
        return value

    def golomb(self) -> int:
        """Return an unsigned number of variable length (H.264, 9.1)."""
        zeros = 0
        while not self.number(1):
            zeros += 1
            if zeros > _MOST_ZEROS:
                raise IndexError
        return (1 << zeros) - 1 + self.number(zeros)

    def signed_golomb(self) -> int:
        code = self.golomb()
        return (code + 1) // 2 if code % 2 else -(code // 2)


def _numbering(bits: _Bits) -> tuple[int, _Numbering | None]:
    """Return the identity of sequence parameters, and their numbering (WIRE: H.264, 7.3.2.1.1)."""
    profile = bits.number(8)
    bits.number(16)  # constraints, level
    identity, separate = bits.golomb(), False
    if profile in _WITH_FORMAT:
        colours = bits.golomb()
        separate = colours == _SEPARATE_COLOURS and bool(bits.number(1))
        bits.golomb()  # bit depths
        bits.golomb()
        bits.number(1)
        if bits.number(1):
            _skip_scaling_lists(bits, 12 if colours == _SEPARATE_COLOURS else 8)
    number_bits = bits.golomb() + 4
    _skip_order(bits)
    bits.golomb()  # max_num_ref_frames
    numbering = _Numbering(number_bits, bool(bits.number(1)), separate)
    return identity, numbering if number_bits <= 16 else None


def _skip_scaling_lists(bits: _Bits, lists: int) -> None:
    for index in range(lists):
        if not bits.number(1):
            continue
        last = following = 8
        for _ in range(16 if index < 6 else 64):
            if following:
                following = (last + bits.signed_golomb()) % 256
            last = following or last


def _skip_order(bits: _Bits) -> None:
    kind = bits.golomb()
    if kind == 0:
        bits.golomb()
    elif kind == 1:
        bits.number(1)
        for _ in range(2):
            bits.golomb()
        for _ in range(min(bits.golomb(), 256)):
            bits.golomb()
