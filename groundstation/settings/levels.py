"""Resolves a field file: options, calibrations, then defaults < type < robot."""

import json
import re
from collections.abc import Collection, Iterable
from difflib import get_close_matches
from pathlib import Path

from groundstation.errors import SettingsError, without_password
from groundstation.settings.document import KeyPath, Node, SourceLine, dotted, parse
from groundstation.settings.foreign_lens import read_calibration
from groundstation.settings.wording import problem

# Sections of sensors fixed in the world, and all sections that are mappings of names.
FIXED = ("cameras", "motion_capture", "ranging")
NAMED = ("drones", *FIXED, "targets", "types")

_INDEX = re.compile("[0-9]{1,5}")


def with_options(tree: Node, options: Iterable[str], named: Collection[str] = ()) -> tuple[Node, list[str]]:
    """Return the tree with all options set that can be, and the problems of the others; see `with_option`."""
    problems: list[str] = []
    for option in options:
        try:
            tree = with_option(tree, option, named)
        except SettingsError as error:
            problems += error.problems
    return tree, problems


def with_option(tree: Node, option: str, named: Collection[str] = ()) -> Node:
    """Return the tree with `a.b=c` set; c is YAML, null removes the key. Raises SettingsError naming the option.

    named: top-level mappings of names, in which an option may change an entry, but not invent one.
    """
    name, equals, text = option.partition("=")
    place = f"--set {' '.join(f'{name}{equals}{without_password(text)}'.split())}"
    path = tuple(part.strip() for part in name.split("."))
    if not equals or not all(path):
        raise SettingsError([f"{place}: must look like path.to.key=value"])
    value = parse(text, place, line=0) if text.strip() else Node("", SourceLine(place, 0))
    if len(path) > 1 and path[0] in named:
        _require_entry(tree, path[0], path[1], place)
    return _placed(tree, path, value, (), place)


def _require_entry(tree: Node, section: str, name: str, place: str) -> None:
    holder = tree.get(section)
    if holder is not None and isinstance(holder.value, dict) and name not in holder.value:
        near = get_close_matches(name, holder.value, 1, 0.5)
        meant = f"did you mean {section}.{near[0]}?" if near else f"there are {', '.join(holder.value)}"
        raise SettingsError([f"{place}: there is no {section}.{name}, {meant}"])


def _placed(tree: Node, path: KeyPath, value: Node, done: KeyPath, place: str) -> Node:
    if not path:
        return _moved(value, done)
    key, rest = path[0], path[1:]
    if isinstance(tree.value, list):
        if not _INDEX.fullmatch(str(key)) or int(key) >= len(tree.value):
            raise SettingsError([f"{place}: {dotted(done)} is a list of {len(tree.value)}, {key!r} is not in it"])
        items = list(tree.value)
        items[int(key)] = _placed(items[int(key)], rest, value, (*done, int(key)), place)
        return Node(items, SourceLine(place, 0, done))
    if not isinstance(tree.value, dict):
        raise SettingsError([f"{place}: {dotted(done)} is a single value, nothing lies below it"])
    entries = dict(tree.value)
    if not rest and value.value is None:
        entries.pop(str(key), None)
        return Node(entries, tree.origin)
    below = entries.get(str(key)) or Node({}, SourceLine(place, 0, (*done, key)))
    entries[str(key)] = _placed(below, rest, value, (*done, key), place)
    return Node(entries, tree.origin)


def _moved(node: Node, base: KeyPath) -> Node:
    origin = SourceLine(node.origin.place, node.origin.line, (*base, *node.origin.path))
    if isinstance(node.value, dict):
        return Node({key: _moved(inner, base) for key, inner in node.value.items()}, origin)
    if isinstance(node.value, list):
        return Node([_moved(inner, base) for inner in node.value], origin)
    return Node(node.value, origin)


def merged(lower: Node, upper: Node) -> Node:
    """Return a mapping in which entries of `upper` replace those of `lower`, level by level."""
    if not isinstance(lower.value, dict) or not isinstance(upper.value, dict):
        return upper
    entries = dict(lower.value)
    for key, node in upper.value.items():
        entries[key] = merged(entries[key], node) if key in entries else node
    return Node(entries, upper.origin)


class Calibrations:
    """Reads calibration files beside the field file, each once; notes faults and the entries that have them."""

    def __init__(self, directory: Path, name: str) -> None:
        self._directory = directory
        self._name = name
        self._known: dict[str, Node | None] = {}
        self.problems: list[str] = []
        self.failed: set[SourceLine] = set()

    def inlined(self, holder: Node) -> Node:
        """Return a mapping (a camera, or a drone with one) with the name of a calibration replaced by its content."""
        if not isinstance(holder.value, dict):
            return holder
        entries = dict(holder.value)
        camera, calibration = holder.get("camera"), holder.get("calibration")
        if camera is not None:
            entries["camera"] = self.inlined(camera)
        if calibration is not None and isinstance(calibration.value, str):
            content = self._content(calibration)
            if content is None:
                self.failed.add(calibration.origin)
            else:
                entries["calibration"] = content
        return Node(entries, holder.origin)

    def _content(self, entry: Node) -> Node | None:
        name = entry.value
        if name not in self._known:
            try:
                shown, named_in = str(Path(self._name).parent / name), self._directory / Path(self._name).name
                self._known[name] = read_calibration(self._directory / name, shown, named_in)
            except SettingsError as error:
                self._known[name] = None
                self.problems += [problem(entry.origin, text) for text in error.problems]
        return self._known[name]


class Levels:
    """The resolved tree of a field file, and the fragments (`defaults`, `types`) it was merged from."""

    def __init__(self, tree: Node, calibrations: Calibrations) -> None:
        self.problems: list[str] = []
        self.untyped: set[str] = set()
        self._entries = dict(tree.value)
        none = Node({}, tree.origin)
        self.defaults = calibrations.inlined(self._entries.pop("defaults", none))
        types = self._entries.pop("types", none)
        self.types = self._mapping(types, "type names") and {
            name: calibrations.inlined(node) for name, node in types.value.items()
        }
        for key in ("drones", "cameras"):
            section = self._entries.get(key)
            if section is not None and isinstance(section.value, dict):
                entries = {name: calibrations.inlined(node) for name, node in section.value.items()}
                self._entries[key] = Node(entries, section.origin)
        drones = self._entries.get("drones")
        if drones is not None and isinstance(drones.value, dict):
            entries = {name: self._resolved(name, node) for name, node in drones.value.items()}
            self._entries["drones"] = Node(entries, drones.origin)
        self.tree = Node(self._entries, tree.origin)

    def _mapping(self, node: Node, what: str) -> dict[str, Node]:
        if isinstance(node.value, dict):
            return node.value
        self.problems.append(problem(node.origin, f"must be a mapping of {what}"))
        return {}

    def _resolved(self, name: str, drone: Node) -> Node:
        if not isinstance(drone.value, dict):
            return drone
        entries = dict(drone.value)
        kind = entries.pop("type", None)
        base = self.defaults
        if kind is not None and isinstance(kind.value, str) and kind.value in self.types:
            base = merged(base, self.types[kind.value])
        elif kind is not None:
            self.untyped.add(name)
            near = get_close_matches(str(kind.value), self.types, 1, 0.5)
            meant = f", did you mean {near[0]}?" if near else f"; there are: {', '.join(self.types) or 'none'}"
            self.problems.append(problem(kind.origin, f"there is no type {json.dumps(kind.plain())}{meant}"))
        return merged(base, Node(entries, drone.origin))
