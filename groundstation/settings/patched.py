"""Changes some settings in a field file's text and keeps all else, comments included."""

import copy
import io
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from groundstation.errors import OperatorMistake, SettingsError
from groundstation.settings.document import without_end
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

    tree = YAML().load(without_end(text))
    for path, value in changes.items():
        _placed(tree, path, value, resolved)
    return _written(tree)


def write_patched(target: Path, text: str, changes: Changes, resolved: Mapping[str, Any]) -> None:
    """Write a patched field file; raises OperatorMistake, and leaves the old file, if the result could not be read."""
    tried = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        tried.write_text(patched(text, changes, resolved), encoding="utf-8")
        load_field(tried)
        tried.replace(target)
    except OSError as error:
        raise OperatorMistake(f"{target}: cannot be written ({error.strerror})") from None
    except SettingsError as error:
        problem = error.problems[0].replace(str(tried), str(target))
        beside = ": write it beside the field file, whose calibrations it names" if "no such file" in problem else ""
        raise OperatorMistake(f"{target}: is not written, it could not be used ({problem}){beside}") from None
    finally:
        with suppress(OSError):
            tried.unlink()


def _placed(tree: Any, path: tuple[str, ...], value: Any, resolved: Any) -> None:
    *parents, last = path
    for name in parents:
        resolved = resolved.get(name, {}) if isinstance(resolved, Mapping) else {}
        if not isinstance(tree.get(name), dict):
            tree[name] = dict(resolved) if isinstance(tree.get(name), str) else {}
        elif _has_anchor(tree[name]):
            tree[name] = copy.deepcopy(tree[name])  # an alias of it elsewhere in the file keeps its content
        tree = tree[name]
    tree[last] = value


def _has_anchor(node: Any) -> bool:
    anchor = getattr(node, "yaml_anchor", None)  # a new node has none
    return anchor is not None and anchor() is not None


def _written(tree: Any) -> str:
    from ruamel.yaml import YAML

    yaml = YAML()
    yaml.width = 120
    stream = io.StringIO()
    yaml.dump(tree, stream)
    return stream.getvalue()
