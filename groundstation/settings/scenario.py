"""Scenario files: read here, understood by the simulator alone."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from groundstation.errors import SettingsError
from groundstation.settings.document import Node, read
from groundstation.settings.levels import with_option


def read_scenario(path: Path, options: Sequence[str] = ()) -> Node:
    """Return a scenario's tree with `a.b=c` options applied; raises SettingsError for what is not YAML."""
    tree = read(path)
    if not isinstance(tree.value, dict):
        raise SettingsError([f"{tree.origin}: must be a mapping with schema_version, target, drones, ..."])
    for option in options:
        tree = with_option(tree, option)
    return tree


def load_scenario(path: Path, options: Sequence[str] = ()) -> dict[str, Any]:
    """Return a scenario as plain values for the simulator, which is the one to judge them."""
    plain = read_scenario(path, options).plain()
    assert isinstance(plain, dict)
    return plain
