"""Reads the field of a recording in today's form, also with changed settings for a re-run."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from groundstation.errors import SettingsError
from groundstation.settings.document import Node, parse, read
from groundstation.settings.load import field_of_tree
from groundstation.settings.schema import Field

_NAME = "recorded field"
_SECTION = "estimator"


def recorded_field(content: bytes, options: Sequence[str] = (), estimator: Path | None = None) -> Field:
    """Return a recorded field (JSON) with `a.b=c` options applied; raises SettingsError with all problems.

    estimator: a field file, or a file with an `estimator:` section alone; that section then replaces the recorded one,
    and keys that it leaves out have their defaults. Options come last. Keys newer than the recording have defaults.
    """
    tree = _with_kinds_sections(parse(content.decode("utf-8", "replace"), _NAME))
    if estimator is not None:
        tree = _with_section(tree, read(estimator), estimator)
    return field_of_tree(tree, options, Path(_NAME))


def _with_kinds_sections(tree: Node) -> Node:
    """Return the tree with the sections of each drone's kind beside its other keys; re-runs record them together."""
    drones = tree.get("drones")
    if not isinstance(tree.value, dict) or drones is None or not isinstance(drones.value, dict):
        return tree
    spread = replace(drones, value={name: _spread(drone) for name, drone in drones.value.items()})
    return replace(tree, value={**tree.value, "drones": spread})


def _spread(drone: Node) -> Node:
    together = drone.get("sections") if isinstance(drone.value, dict) else None
    if together is None or not isinstance(drone.value, dict) or not isinstance(together.value, dict):
        return drone
    common = {key: node for key, node in drone.value.items() if key != "sections"}
    return replace(drone, value={**together.value, **common})


def _with_section(tree: Node, other: Node, path: Path) -> Node:
    section = other.get(_SECTION)
    if section is None:
        raise SettingsError([f"{path}: has no `{_SECTION}:` section"])
    if not isinstance(tree.value, dict):
        return tree  # the loader reports its faults
    return replace(tree, value={**tree.value, _SECTION: section})
