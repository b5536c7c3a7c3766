"""Whether a scenario fits the field that is flown in it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from groundstation.settings.drawing import beyond_walls, paths_of
from groundstation.settings.parked import on_pads
from groundstation.settings.schema import Field


def misfits(field: Field, scenario: Mapping[str, Any]) -> list[str]:
    """Return a sentence for each target whose path leaves the room, or that waits on a drone's pad."""
    return beyond_walls(field, paths_of(scenario, field.tracked)) + on_pads(field, scenario)


def made_for(path: Path, scenario: Mapping[str, Any]) -> list[str]:
    """Return a sentence if a scenario is made for another field than the one at a path, or for a changed one."""
    expected = scenario.get("expected") or {}
    other = expected.get("field", path.stem)
    found = [] if other == path.stem else [f"is made for the field {other}"]
    if expected.get("set"):
        found.append(
            "is made for a field changed as its expected.set says; only groundstation experiment scenarios changes it"
        )
    return found
