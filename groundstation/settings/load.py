"""Reads a field file, and reports all problems at once, each with file and line."""

import json
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path
from typing import Any, get_args

from pydantic import TypeAdapter, ValidationError

from groundstation.errors import SettingsError
from groundstation.settings.cautions import cautions
from groundstation.settings.checks import findings
from groundstation.settings.document import KeyPath, Node, SourceLine, read
from groundstation.settings.drones import Drone
from groundstation.settings.levels import FIXED, NAMED, Calibrations, Levels, with_options
from groundstation.settings.parts import Parts
from groundstation.settings.schema import SCHEMA_VERSION, Field
from groundstation.settings.sections import faults_of_kinds
from groundstation.settings.wording import ordered, problem, problem_of_error


def load_field(path: Path | str, options: Sequence[str] = ()) -> Field:
    """Return the resolved field of a file with `a.b=c` options applied; raises SettingsError with all problems."""
    path = Path(path)
    return field_of_tree(read(path), options, path)


def field_of_tree(tree: Node, options: Sequence[str], path: Path) -> Field:
    """Return the resolved field of a document that came from `path`, as `load_field` does."""
    tree, problems = _with_options(tree, options)
    _require_version(tree, problems)
    calibrations = Calibrations(path.parent, str(path))
    levels = Levels(tree, calibrations)
    problems += calibrations.problems + levels.problems
    errors = _errors(Field, levels.tree)
    problems += _worded(errors, levels.tree, Field, calibrations.failed, levels.untyped)
    for fragment in (levels.defaults, *levels.types.values()):
        problems += _worded(_partial_errors(fragment), fragment, Drone, calibrations.failed)
    problems += _target_or_targets(levels.tree)
    parts = _sound_parts(levels.tree.plain(), [error["loc"] for error in errors])
    problems += [problem(levels.tree.origin_of(at), text) for at, text in findings(parts)]
    if problems:
        raise SettingsError(ordered(problems))
    field = Field.model_validate_json(json.dumps(levels.tree.plain()))
    flying = {name: drone for name, drone in field.drones.items() if drone.enabled}
    return field.model_copy(update={"drones": flying})


def cautions_of(path: Path | str, options: Sequence[str] = ()) -> list[str]:
    """Return the warnings about a field file without mistakes, a line each.

    Raises SettingsError as above, and for a kind of vehicle that could not be flown or stopped.
    """
    path = Path(path)
    field = load_field(path, options)
    tree, _ = _with_options(read(path), options)
    origins = Levels(tree, Calibrations(path.parent, str(path))).tree
    if faults := [problem(origins.origin_of(at), text) for at, text in faults_of_kinds(field)]:
        raise SettingsError(ordered(faults))
    return ordered([problem(origins.origin_of(at), text) for at, text in cautions(field)])


def _with_options(tree: Node, options: Iterable[str]) -> tuple[Node, list[str]]:
    if not isinstance(tree.value, dict):
        raise SettingsError([f"{tree.origin}: must be a mapping with schema_version, room, drones, ..."])
    return with_options(tree, options, NAMED)


def _require_version(tree: Node, problems: list[str]) -> None:
    """Raise at once for another version: nothing else in such a file can be judged."""
    version = tree.get("schema_version")
    if version is None:
        raise SettingsError([*problems, f"{tree.origin}: schema_version: is required, {SCHEMA_VERSION} here"])
    if version.value != SCHEMA_VERSION or isinstance(version.value, bool):
        text = f"must be {SCHEMA_VERSION}, the version that this program reads (got {json.dumps(version.plain())})"
        raise SettingsError([*problems, problem(version.origin, text)])


def _target_or_targets(tree: Node) -> list[str]:
    """Return the fault of a field with neither `target` nor `targets`, or with both."""
    single, several = (_given(tree.get(key)) for key in ("target", "targets"))
    if single is None and several is None:
        return [f"{tree.origin}: target: is required (or targets, for several)"]
    if single is not None and several is not None:
        return [problem(several.origin, "must not stand beside target: put all into targets, each by its name")]
    return []


def _given(node: Node | None) -> Node | None:
    return None if node is None or node.value is None or node.value == {} else node


def _errors(model: type[Any], tree: Node) -> list[Any]:
    try:
        TypeAdapter(model).validate_json(json.dumps(tree.plain()))
    except ValidationError as error:
        return error.errors(include_url=False)
    return []


def _partial_errors(fragment: Node) -> list[Any]:
    """Return the errors in a part of a drone; missing keys are none."""
    return [error for error in _errors(Drone, fragment) if error["type"] != "missing"]


def _worded(
    errors: Iterable[Any], tree: Node, model: type[Any], failed: Collection[SourceLine], untyped: Collection[str] = ()
) -> list[str]:
    """Return a line for each error, without those that follow from a missing calibration or an unknown type."""

    def follows(error: Any) -> bool:
        lacks_type = error["type"] == "missing" and error["loc"][:2] in {("drones", name) for name in untyped}
        return lacks_type or tree.origin_of(error["loc"]) in failed

    return [problem_of_error(error, tree, model) for error in errors if not follows(error)]


def _sound_parts(plain: dict[str, Any], faults: Collection[KeyPath]) -> Parts:
    """Return the sections without an error of their own, and drones and cameras without their faulty entries."""

    def sound(model: Any, *path: str) -> Any:
        value: Any = plain
        for key in path:
            value = value.get(key) if isinstance(value, dict) else None
        if any(fault[: len(path)] == path for fault in faults):
            return None
        if value is None:
            return Field.model_fields[path[0]].default
        return _valid(model, value)

    def named(section: str) -> dict[str, Any]:
        model = get_args(Field.model_fields[section].annotation)[1]
        entries = plain.get(section)
        if not isinstance(entries, dict):
            return {}
        below = [fault[1:] for fault in faults if fault[:1] == (section,)]
        return {name: value for name, entry in _without(entries, below).items() if (value := _valid(model, entry))}

    # Defaults of Field replace sections that are left out; a missing required one is a fault of its own.
    single = ("room", "target", "estimator", "planner", "safety", "bus")
    return Parts(
        cameras=named("cameras"),
        motion_capture=named("motion_capture"),
        ranging=named("ranging"),
        truth=_text(plain.get("truth"), "from"),
        given=frozenset(name for section in FIXED for name in _keys(plain.get(section))),
        bodies=frozenset(name for section in ("drones", "targets") for name in _keys(plain.get(section)))
        | {_text(plain.get("target"), "name") or ""},
        drones=named("drones"),
        targets=named("targets"),
        **{name: sound(Field.model_fields[name].annotation, name) for name in single},
    )


def _keys(section: Any) -> list[str]:
    return list(section) if isinstance(section, dict) else []


def _text(section: Any, key: str) -> str | None:
    value = section.get(key) if isinstance(section, dict) else None
    return value if isinstance(value, str) else None


def _valid(model: Any, value: Any) -> Any:
    try:
        return TypeAdapter(model).validate_json(json.dumps(value))
    except ValidationError:
        return None


def _without(entries: dict[str, Any], faults: Collection[KeyPath]) -> dict[str, Any]:
    """Return a copy of nested mappings that lacks the entries at the given paths."""
    kept = {}
    for key, value in entries.items():
        below = [fault[1:] for fault in faults if fault[:1] == (key,)]
        if isinstance(value, dict) and all(below):
            kept[key] = _without(value, below)
        elif not below:
            kept[key] = value
    return kept
