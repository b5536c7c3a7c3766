"""Header, finiteness and shapes that every message shares."""

import math
from typing import Annotated, Any

import msgspec
from msgspec.structs import astuple

_WHOLE_LIMIT = 2**63
# JSON carries whole numbers of any length, but numpy, MCAP and our own encoder end at 64 bits.
Whole = Annotated[int, msgspec.Meta(ge=-_WHOLE_LIMIT, le=_WHOLE_LIMIT - 1)]


_ALWAYS = frozenset((str, bool, type(None)))  # types of values that cannot be out of range
_FLOATS, _INTEGERS = frozenset((float,)), frozenset((int,))


def _is_finite(value: Any) -> bool:
    kind = type(value)
    if kind in _ALWAYS:
        return True
    if kind is float:
        return math.isfinite(value)
    if kind is tuple:
        return _all_finite(value)
    if kind is Header:
        return _is_whole(value.stamp_ns) and _is_whole(value.seq)
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, int):
        return _is_whole(value)
    if isinstance(value, str):
        return True
    if isinstance(value, tuple):
        return _all_finite(value)
    if isinstance(value, msgspec.Struct):
        return all(map(_is_finite, astuple(value)))
    if isinstance(value, dict):
        return all(map(_is_finite, value.values()))
    return True


def _all_finite(values: tuple[Any, ...]) -> bool:
    kinds = set(map(type, values))  # vectors, matrices and maps are most of what is checked
    if kinds == _FLOATS:  # no sum of them is finite if one of them is not
        return math.isfinite(sum(values)) or all(map(math.isfinite, values))
    if kinds == _INTEGERS:
        return _is_whole(min(values)) and _is_whole(max(values))
    return all(map(_is_finite, values))


def _is_whole(value: int) -> bool:
    return -_WHOLE_LIMIT <= value < _WHOLE_LIMIT


class Header(msgspec.Struct, frozen=True, gc=False):
    """Time, subject and source of a message."""

    stamp_ns: Whole
    """Time of the measurement [ns] on the boot clock named by `clock`."""
    clock: str
    """Id of the host's boot clock that the stamp was read from."""
    entity: str
    """The robot, camera or process that the message is about."""
    source: str
    """The process that sends it."""
    seq: Whole
    """Rises by one with each message of the sender about the entity, whatever its topic."""


class Message(msgspec.Struct, frozen=True, kw_only=True):
    """Base of all messages: a header, and fields whose numbers are finite and fit 64 bits (ValueError otherwise)."""

    header: Header
    """Stamp, entity and source."""

    def __post_init__(self) -> None:
        for value in astuple(self):
            kind = type(value)
            if math.isfinite(value) if kind is float else kind in _ALWAYS or _is_finite(value):
                continue
            name = next(name for name in self.__struct_fields__ if not _is_finite(getattr(self, name)))
            raise ValueError(f"{name} is not finite")


def require_square(name: str, covariance: tuple[float, ...], sizes: tuple[int, ...]) -> None:
    """Raise ValueError unless a row-major covariance belongs to a square matrix of one of the sizes."""
    if len(covariance) not in {n * n for n in sizes}:
        raise ValueError(f"{name} has {len(covariance)} entries, expected one of {[n * n for n in sizes]}")
