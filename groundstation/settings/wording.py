"""Validation errors in the operator's words: place, path, allowed range, and the probable intention."""

import json
import re
from collections.abc import Collection, Iterator, Mapping
from difflib import get_close_matches
from typing import Any, NamedTuple, get_args

from pydantic import BaseModel

from groundstation.errors import without_password
from groundstation.settings.document import Node, SourceLine, dotted

_PLAIN = {
    "missing": "is required",
    "float_type": "must be a number",
    "float_parsing": "must be a number",
    "int_type": "must be a whole number",
    "int_parsing": "must be a whole number",
    "int_from_float": "must be a whole number",
    "bool_type": "must be true or false",
    "string_type": "must be text",
    "tuple_type": "must be a list",
    "list_type": "must be a list",
    "dict_type": "must be a mapping of names",
    "model_type": "must be a mapping",
    "model_attributes_type": "must be a mapping",
    "finite_number": "must be finite",
    "string_too_short": "must not be empty",
    "date_from_datetime_parsing": "must be a date such as 2026-11-20",
    "date_parsing": "must be a date such as 2026-11-20",
    "date_type": "must be a date such as 2026-11-20",
}
# Keys of a field file that a resolved field lacks.
_ONLY_IN_FILES = {"Field": ("defaults", "types"), "Drone": ("type",)}
_BOUNDS = {
    "greater_than": (">", "gt"),
    "greater_than_equal": (">=", "ge"),
    "less_than": ("<", "lt"),
    "less_than_equal": ("<=", "le"),
}


def problem(origin: SourceLine, text: str) -> str:
    """Return one line: `lab.yaml:37: drones.drone_1.pad_m: must ...`."""
    return f"{origin}: {dotted(origin.path)}: {text}" if origin.path else f"{origin}: {text}"


def problem_of_error(error: Mapping[str, Any], tree: Node, model: type[BaseModel]) -> str:
    """Return the line for one error of pydantic on the plain value of `tree` (whose root is a `model`)."""
    path = tuple(key for key in error["loc"] if key != "[key]")
    origin = tree.origin_of(path)
    if error["type"] == "missing" and origin.path[:1] != path[:1] and "calibration" not in path[:-1]:
        # Missing in all three levels together: reported at the robot's entry.
        origin = SourceLine(tree.origin_of(path[:2]).place, tree.origin_of(path[:2]).line, path)
    if error["type"] == "extra_forbidden":
        return problem(origin, f"unknown key{_meant(str(path[-1]), model, path[:-1])}")
    return problem(origin, text_of_error(error))


def text_of_error(error: Mapping[str, Any]) -> str:
    """Return the text of an error without its place."""
    kind, context, got = error["type"], error.get("ctx", {}), _shown(error["input"])
    if kind == "missing":
        return _PLAIN[kind]
    if kind in _BOUNDS:
        sign, name = _BOUNDS[kind]
        return f"must be {sign} {context[name]:g} (got {got})"
    if kind == "union_tag_invalid":
        key, expected = str(context["discriminator"]).strip("'"), context["expected_tags"]
        return f"{key} must be one of {expected} (got {_shown(context['tag'])}){_close(context['tag'], expected)}"
    if kind in ("literal_error", "enum"):
        return f"must be {context['expected']} (got {got}){_close(str(error['input']), context['expected'])}"
    if kind in ("too_short", "too_long"):
        return f"must hold {_count(context)} (got {context['actual_length']})"
    if kind == "string_pattern_mismatch":
        return f"must match {context['pattern']} (got {got})"
    if kind in ("entries", "rows", "rising", "falling"):
        return str(error["msg"])
    return f"{_PLAIN.get(kind, error['msg'])} (got {got})"


def _count(context: Mapping[str, Any]) -> str:
    least, most = context.get("min_length"), context.get("max_length")
    return f"at least {least}" if least is not None else f"at most {most}"


def _shown(value: Any) -> str:
    if isinstance(value, dict | BaseModel):
        return "a mapping"
    if isinstance(value, str):
        value = without_password(value)
    text = json.dumps(value, default=str, ensure_ascii=False)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _close(word: str, expected: str) -> str:
    near = get_close_matches(word, expected.replace("'", "").replace(" or ", ", ").split(", "), 1)
    return f", did you mean {near[0]}?" if near else ""


def _meant(key: str, model: type[BaseModel], path: tuple[str | int, ...]) -> str:
    owner = _model_at(model, path)
    if owner is None:
        return ""
    siblings = [*owner.model_fields, *_ONLY_IN_FILES.get(owner.__name__, ())]
    deeper = {inner.rsplit(".", 1)[-1]: inner for inner in _descendants(owner)}
    return closest(key, siblings, deeper)


def closest(key: str, known: Collection[str], deeper: Mapping[str, str] | None = None) -> str:
    """Return the end of a sentence about an unknown key: the likeliest key, or all keys known here.

    deeper: keys further down, with their paths.
    """
    near = get_close_matches(key, known, 1)
    if near:
        return f", did you mean {near[0]}?"
    near = get_close_matches(key, deeper or (), 1, 0.75)
    if deeper and near:
        return f", did you mean {deeper[near[0]]}?"
    return f"; known here: {', '.join(known)}"


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from _models_in(argument)


def _model_at(model: type[BaseModel] | None, path: tuple[str | int, ...]) -> type[BaseModel] | None:
    keys = list(path)
    while keys and model is not None:
        info = model.model_fields.get(str(keys.pop(0)))
        if info is None:
            return None
        model = next(_models_in(info.annotation), None)
        if keys and getattr(info.annotation, "__origin__", None) is dict:
            keys.pop(0)
    return model


def _descendants(model: type[BaseModel], prefix: str = "") -> Iterator[str]:
    for name, info in model.model_fields.items():
        for inner in _models_in(info.annotation):
            yield from (f"{prefix}{name}.{key}" for key in inner.model_fields)
            yield from _descendants(inner, f"{prefix}{name}.")


_LINE = re.compile(
    r"(?:--set .+?(?=: [\w.\[\]-]+: )|--set \S+|(?P<file>.+?):(?P<line>\d+)): (?:(?P<path>[\w.\[\]-]+): )?(?P<text>.*)",
    re.DOTALL,
)


class Told(NamedTuple):
    """A problem in parts: its origin, its key ("": the whole file), its gravity, and its text."""

    file: str
    line: int
    path: str
    level: str
    text: str


def told(line: str, level: str) -> Told:
    """Return the parts of one line of `problem`; a line without file and line number is all text."""
    match = _LINE.fullmatch(line)
    if match is None:
        return Told("", 0, "", level, line)
    return Told(match["file"] or "", int(match["line"] or 0), match["path"] or "", level, match["text"])


def ordered(problems: list[str]) -> list[str]:
    """Return each problem once, in the order of the file's lines."""

    def rank(text: str) -> tuple[str, int]:
        place, _, rest = text.partition(":")
        line = rest.split(":", 1)[0]
        return place, int(line) if re.fullmatch("[0-9]{1,9}", line) else 0

    return sorted(dict.fromkeys(problems), key=rank)
