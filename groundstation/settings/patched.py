"""A field file with some settings changed and all else, comments included, as it was written."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from groundstation.errors import OperatorMistake, SettingsError
from groundstation.settings.load import load_field

Changes = Mapping[tuple[str, ...], Any]
"""New values by their path."""


def fragment(changes: Changes) -> str:
    """Return the changed settings alone, as YAML."""
    tree: dict[str, Any] = {}
    for path, value in changes.items():
        _placed(tree, path, value, {})
    return _written(tree)


def patched(text: str, changes: Changes, resolved: Mapping[str, Any]) -> str:
    """Return a field file's text with settings changed; resolved: the field with nothing left to look up.

    A calibration that is the name of a file becomes its content where one of its figures changes.
    """
    from ruamel.yaml import YAML

    tree = YAML().load(text)
    for path, value in changes.items():
        _placed(tree, path, value, resolved)
    return _written(tree)


def write_patched(target: Path, text: str, changes: Changes, resolved: Mapping[str, Any]) -> None:
    """Write a patched field file and read it back; raises OperatorMistake where it cannot be written or read."""
    try:
        target.write_text(patched(text, changes, resolved), encoding="utf-8")
    except OSError as error:
        raise OperatorMistake(f"{target}: cannot be written ({error.strerror})") from None
    try:
        load_field(target)
    except SettingsError as error:
        remedy = "write it beside the field file, whose calibrations it names"
        raise OperatorMistake(f"{target}: is written, but cannot be used ({error.problems[0]}): {remedy}") from None


def _placed(tree: Any, path: tuple[str, ...], value: Any, resolved: Any) -> None:
    *parents, last = path
    for name in parents:
        resolved = resolved.get(name, {}) if isinstance(resolved, Mapping) else {}
        if not isinstance(tree.get(name), dict):
            tree[name] = dict(resolved) if isinstance(tree.get(name), str) else {}
        tree = tree[name]
    tree[last] = value


def _written(tree: Any) -> str:
    from ruamel.yaml import YAML

    yaml = YAML()
    yaml.width = 120
    stream = io.StringIO()
    yaml.dump(tree, stream)
    return stream.getvalue()
