"""The wire format of one navdata option: a struct format over a named tuple."""

import struct
from collections.abc import Callable, Sequence
from enum import IntEnum
from functools import partial
from operator import itemgetter
from typing import Any, Generic, TypeVar

from drivers.ardrone.wire.errors import WireError

Value = TypeVar("Value", bound=tuple[Any, ...])
_HEAD = 4


class OptionLayout(Generic[Value]):
    """One option's number, value type and wire format.

    fields: one token per field of the value type in `struct` notation; a token with a count is a tuple field. start:
    offset in the option, its 4-byte head included; if beyond the head, only newer firmwares have that part. newer: only
    newer firmwares send it; exact: an option of another size is something else.
    """

    def __init__(
        self,
        tag: IntEnum,
        value_type: type[Value],
        fields: str,
        *,
        start: int = _HEAD,
        newer: bool = False,
        exact: bool = False,
    ) -> None:
        self.tag, self.number, self.start = tag, int(tag), start
        self._optional, self._exact = newer or exact or start > _HEAD, exact
        # The counts match by construction: this is `_make` without its check.
        self._make: Callable[[tuple[Any, ...]], Value] = partial(tuple.__new__, value_type)
        self._struct = struct.Struct("<" + fields.replace(" ", ""))
        counts = [1 if token.endswith("s") else int(token[:-1] or 1) for token in fields.split()]
        ends = [sum(counts[: i + 1]) for i in range(len(counts))]
        self._flat = len(counts) == ends[-1]
        # itemgetter of one item would return it bare: an empty slice at the end makes it a tuple.
        places = [slice(e - n, e) if n > 1 else e - n for e, n in zip(ends, counts, strict=True)]
        self._group: Callable[[tuple[Any, ...]], tuple[Any, ...]] = itemgetter(*places, slice(0, 0))
        self._skip = start - _HEAD
        self.size = start + self._struct.size

    def read(self, payload: bytes) -> Value | None:
        """Return the value in a payload, or None if the firmware that sent it does not have the layout at all."""
        if self._optional:
            missing = self.size - _HEAD - len(payload)
            if missing > 0 or (self._exact and missing):
                return None
        return self.decode(payload)

    def decode(self, payload: bytes) -> Value:
        """Return the value in a payload (option without its 4-byte head); surplus is ignored.

        Raises WireError (option_size) when the payload is shorter than this layout.
        """
        try:
            flat = self._struct.unpack_from(payload, self._skip)
        except struct.error:
            raise WireError(
                "option_size", f"{self.tag.name} has {len(payload) + _HEAD} bytes, {self.size} needed"
            ) from None
        return self._make(flat if self._flat else self._group(flat)[:-1])

    def encode(self, value: Value, size: int = 0) -> bytes:
        """Return the payload, zero-filled to an option of `size` bytes (its head included) and before `start`.

        Raises WireError (value) when a field does not fit its type.
        """
        flat: Sequence[Any] = value
        if not self._flat:
            flat = [item for field in value for item in (field if isinstance(field, tuple) else (field,))]
        try:
            payload = bytes(self._skip) + self._struct.pack(*flat)
        except (struct.error, OverflowError) as error:
            raise WireError("value", f"{self.tag.name}: {error}") from error
        return payload.ljust(size - _HEAD, b"\0")
