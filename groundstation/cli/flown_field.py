"""Whether a field file is that of a flight."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from groundstation.errors import OperatorMistake
from groundstation.settings.differences import differences

if TYPE_CHECKING:
    from groundstation.settings.schema import Field

_NAMED = ("cameras", "motion_capture", "ranging", "drones", "targets")
_COMPARED = (*_NAMED, "target")
_TOLD = 5  # differences that are told one by one


def differing(path: str, field: "Field", flown: "Field") -> str:
    """Return in which settings of sensors and bodies a field file differs from the flown field, "" if in none.

    Raises OperatorMistake for a file with other sensors or bodies.
    """
    here, there = ({key: one.model_dump(mode="json")[key] for key in _COMPARED} for one in (field, flown))
    if (has := sorted(_names(here))) != (had := sorted(_names(there))):
        raise OperatorMistake(
            f"{path}: is not the field of this flight: it has {', '.join(has)}; the flight had {', '.join(had)}"
        )
    found = [f"{'.'.join(at)} {value} (flown: {was})" for at, value, was in differences(here, there)]
    if not found:
        return ""
    others = f" and {len(found) - _TOLD} others" if len(found) > _TOLD else ""
    return f"{path} has {', '.join(found[:_TOLD])}{others}"


def _names(parts: Mapping[str, Any]) -> Iterator[str]:
    if parts["target"]:
        yield parts["target"]["name"]
    for section in _NAMED:
        yield from parts[section] or ()
