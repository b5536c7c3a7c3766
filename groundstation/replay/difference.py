"""The first difference of two messages, and its size."""

import math
from dataclasses import dataclass
from typing import Any

import msgspec

# Wall time is not repeated; headers count messages that a replay does not send.
_NOT_COMPARED = frozenset({"header", "seconds"})


@dataclass(frozen=True, slots=True)
class MessageDifference:
    """A place inside a message, its recorded and its present value; by: present minus recorded, for numbers."""

    place: str
    recorded: Any
    now: Any

    @property
    def by(self) -> float | None:
        """Return the difference, None if these are not numbers."""
        if isinstance(self.recorded, int | float) and isinstance(self.now, int | float):
            return float(self.now) - float(self.recorded)
        return None

    def __str__(self) -> str:
        by = f" ({self.by:+.3g})" if self.by is not None else ""
        return f"{self.place}: recorded {_short(self.recorded)}, now {_short(self.now)}{by}"


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def first_difference(recorded: Any, now: Any, place: str = "") -> MessageDifference | None:
    """Return the first place where two messages or values differ, None if they are identical."""
    if isinstance(recorded, msgspec.Struct) and type(recorded) is type(now):
        for name in recorded.__struct_fields__:
            if name in _NOT_COMPARED:
                continue
            found = first_difference(getattr(recorded, name), getattr(now, name), f"{place}.{name}" if place else name)
            if found:
                return found
        return None
    if isinstance(recorded, tuple) and isinstance(now, tuple):
        if len(recorded) != len(now):
            return MessageDifference(f"number of {place}", len(recorded), len(now))
        pairs = enumerate(zip(recorded, now, strict=True))
        inner = (first_difference(a, b, f"{place}[{getattr(a, 'name', index)}]") for index, (a, b) in pairs)
        return next((difference for difference in inner if difference), None)
    if isinstance(recorded, float) and isinstance(now, float):
        same = recorded == now and math.copysign(1.0, recorded) == math.copysign(1.0, now)
        return None if same else MessageDifference(place, recorded, now)
    return None if recorded == now else MessageDifference(place, recorded, now)
