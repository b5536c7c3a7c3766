"""Settings in which two fields differ."""

from collections.abc import Iterator, Mapping
from typing import Any

KeyPath = tuple[str, ...]


def differences(one: Any, other: Any, at: KeyPath = ()) -> Iterator[tuple[KeyPath, Any, Any]]:
    """Yield the path and both values of each setting that differs, in the first one's order; absent: None."""
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        for key in (*one, *(key for key in other if key not in one)):
            yield from differences(one.get(key), other.get(key), (*at, str(key)))
    elif one != other:
        yield at, one, other
