"""YAML 1.2 documents as trees, with each node's line in the file."""

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from groundstation.errors import SettingsError, without_password

_MAX_BYTES = 1_000_000
_MAX_NODES = 20_000  # an alias may be expanded many times over: bounded, so that a small file cannot fill memory
_MAX_DEPTH = 12
_END = re.compile(r"\n---\s*\Z")
_KINDS = ("str", "int", "float", "bool", "null", "timestamp")

KeyPath = tuple[str | int, ...]


@dataclass(frozen=True, slots=True)
class SourceLine:
    """Origin of a node: a file and line (or an option, then line is 0), and its path there."""

    place: str
    line: int
    path: KeyPath = ()

    def __str__(self) -> str:
        return f"{self.place}:{self.line}" if self.line else self.place

    def below(self, key: str | int) -> "SourceLine":
        """Return the origin for a key that is missing below this node."""
        return SourceLine(self.place, self.line, (*self.path, key))


@dataclass(frozen=True, slots=True)
class Node:
    """A mapping or list of nodes, or a scalar, with its origin."""

    value: Any
    origin: SourceLine

    def plain(self) -> Any:
        """Return the value without origins."""
        if isinstance(self.value, dict):
            return {key: node.plain() for key, node in self.value.items()}
        if isinstance(self.value, list):
            return [node.plain() for node in self.value]
        return self.value

    def get(self, key: str) -> "Node | None":
        """Return an entry of a mapping, None when there is none or this is no mapping."""
        return self.value.get(key) if isinstance(self.value, dict) else None

    def at(self, path: KeyPath) -> "Node | None":
        """Return the node at a path, None when there is none."""
        node: Node | None = self
        for key in path:
            node = _entry(node.value, key) if node is not None else None
        return node

    def origin_of(self, path: KeyPath) -> SourceLine:
        """Return the origin of the value at a path; of a missing one, that of its parent."""
        node = self
        for depth, key in enumerate(path):
            inner = _entry(node.value, key)
            if inner is None:
                origin = node.origin
                for rest in path[depth:]:
                    origin = origin.below(rest)
                return origin
            node = inner
        return node.origin


def _entry(value: Any, key: str | int) -> Node | None:
    if isinstance(value, dict):
        found = value.get(key)
        return found if isinstance(found, Node) else None
    if isinstance(value, list) and isinstance(key, int) and 0 <= key < len(value):
        return value[key] if isinstance(value[key], Node) else None
    return None


def dotted(path: KeyPath) -> str:
    """Return a path in the form an operator reads and types: `drones.drone_1.pad_m[0]`."""
    text = ""
    for key in path:
        text += f"[{key}]" if isinstance(key, int) else f".{key}" if text else key
    return text


def read(path: Path, name: str = "", named_in: Path | None = None) -> Node:
    """Return a file's content; raises SettingsError naming file and line of every fault that makes it unreadable.

    named_in: the file that names this one; it is not suggested in its place.
    """
    name = name or str(path)
    try:
        with open(path, "rb", opener=_without_waiting) as stream:
            content = stream.read(_MAX_BYTES + 1)  # a device (`/dev/zero`) has no end
    except FileNotFoundError:
        raise SettingsError([f"{name}: no such file{_neighbours(path, named_in)}"]) from None
    except OSError as error:
        raise SettingsError([f"{name}: cannot be read ({error.strerror})"]) from None
    if len(content) > _MAX_BYTES:
        raise SettingsError([f"{name}: is larger than {_MAX_BYTES} bytes: not a settings file"])
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SettingsError([f"{name}:{content[: error.start].count(10) + 1}: is not UTF-8 text"]) from None
    return parse(text, name)


def _without_waiting(path: str, flags: int) -> int:
    """Open a file without waiting: a pipe without a writer reads as empty."""
    descriptor = os.open(path, flags | os.O_NONBLOCK)
    os.set_blocking(descriptor, True)
    return descriptor


def _neighbours(path: Path, named_in: Path | None) -> str:
    from difflib import get_close_matches

    if not path.parent.is_dir():
        return ""
    below = (folder / path.name for folder in sorted(path.parent.glob("*")))
    same = next((str(place) for place in below if os.access(place, os.R_OK)), None)
    others = {other.name: other for other in path.parent.glob("*.yaml") if other != named_in}
    near = same or next((str(others[name]) for name in get_close_matches(path.name, others, 1, 0.5)), None)
    return f", did you mean {near}?" if near else ""


def without_end(text: str) -> str:
    """Return a document without the mark of its end (`---`, as ROS prints it), which would begin another."""
    return _END.sub("\n", text)


def parse(text: str, place: str, line: int | None = None) -> Node:
    """Return the tree of one YAML document, behind which nothing but the mark of its end may follow.

    line: fixes the line of all nodes (0 for options).
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    yaml = YAML(typ="safe", pure=True)
    try:
        root = yaml.compose(without_end(text))
        if root is None:
            raise SettingsError([f"{place}: is empty"])
        reader = _Reader(place, line, yaml.constructor)
        node = reader.node(root, ())
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        at = f"{place}:{mark.line + 1}" if mark is not None and line is None else place
        raise SettingsError([f"{at}: {_plainly(error.problem or str(error))}"]) from None
    except (YAMLError, ValueError) as error:
        raise SettingsError([f"{place}: is not YAML ({str(error).splitlines()[0]})"]) from None
    except RecursionError:
        raise SettingsError([f"{place}: is nested too deeply"]) from None
    if reader.problems:
        raise SettingsError(reader.problems)
    return node


def _plainly(problem: str) -> str:
    if "'\\t'" in problem:
        return "a tab stands where YAML wants spaces: indent with spaces"
    if "but found another document" in problem:
        return "holds more than one document: one file, one field"
    return f"is not YAML: {problem}"


class _Reader:
    """Turns composed YAML nodes into ours, noting duplicate keys and values of foreign kinds."""

    def __init__(self, place: str, line: int | None, constructor: Any) -> None:
        self._place = place
        self._line = line
        self._constructor = constructor
        self._count = 0
        self.problems: list[str] = []

    def node(self, source: Any, path: KeyPath, line: int | None = None) -> Node:
        """Return the tree below one YAML node; mappings and scalars take the line of their key."""
        self._count += 1
        origin = self._origin(source, path, line)
        if self._count > _MAX_NODES or len(path) > _MAX_DEPTH:
            raise SettingsError([f"{origin}: is nested too deeply or holds too many values"])
        if source.id == "mapping":
            return Node(dict(self._entries(source, path)), origin)
        if source.id == "sequence":
            return Node([self.node(item, (*path, index)) for index, item in enumerate(source.value)], origin)
        return Node(self._scalar(source, origin), origin)

    def _origin(self, source: Any, path: KeyPath, line: int | None = None) -> SourceLine:
        if self._line is not None:
            return SourceLine(self._place, self._line, path)
        return SourceLine(self._place, (source.start_mark.line if line is None else line) + 1, path)

    def _entries(self, source: Any, path: KeyPath) -> Iterator[tuple[str, Node]]:
        seen: dict[str, int] = {}
        for key, value in source.value:
            line = key.start_mark.line
            name = key.value if key.id == "scalar" else "?"
            origin = self._origin(key, (*path, name))
            if not name.isprintable():
                self.problems.append(f"{origin}: {name!a}: holds a character that cannot be printed")
            elif key.id != "scalar" or key.tag.endswith(":merge"):
                self.problems.append(f"{origin}: {dotted((*path, name))}: must be a plain key (use defaults and types)")
            elif name in seen:
                first = self._origin(key, path, seen[name])
                self.problems.append(f"{origin}: {dotted((*path, name))}: is given twice (first at {first})")
            else:
                seen[name] = line
                yield name, self.node(value, (*path, name), line)

    def _scalar(self, source: Any, origin: SourceLine) -> Any:
        kind = source.tag.rsplit(":", 1)[-1]
        if kind not in _KINDS:
            self.problems.append(f"{origin}: {dotted(origin.path)}: tag {source.tag} is not understood here")
            return None
        if kind in ("str", "timestamp"):
            if not source.value.isprintable():
                self.problems.append(f"{origin}: {dotted(origin.path)}: holds a character that cannot be printed")
            return source.value
        try:
            return self._constructor.construct_object(source)
        except (ValueError, KeyError, IndexError):  # of an explicit tag, the latter two: !!bool maybe, !!int ''
            what = "a number" if kind in ("int", "float") else f"a {kind}"
            self.problems.append(
                f"{origin}: {dotted(origin.path)}: {without_password(source.value)[:40]!r} is not {what}"
            )
            return None
