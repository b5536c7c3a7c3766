"""Tables of keys from a JSON Schema: path, type with range, default and meaning of each."""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from skein_reference.markdown import code, prose, table

Schema = dict[str, Any]
_NAME_PATTERN_START = "^[a-z]"
_REQUIRED = "is required"


@dataclass(frozen=True)
class Key:
    """One key of a file: its dotted path and its schema with references resolved."""

    path: str
    schema: Schema

    @property
    def row(self) -> tuple[str, str, str, str]:
        """Return its line of a table."""
        return code(self.path), type_of(self.schema), _default(self.schema), prose(self.schema.get("description", ""))


class KeyTables:
    """All keys of a schema, in the order of the models."""

    def __init__(self, schema: Schema, apart: frozenset[str] = frozenset()) -> None:
        """`apart`: definitions that have a table of their own and are not descended into."""
        self._schema = schema
        self._apart = apart

    def keys(self, section: Schema, path: str = "") -> Iterator[Key]:
        """Yield the keys below a section, at any depth."""
        for name, content in section.get("properties", {}).items():
            required = name in section.get("required", ())
            yield from self._key(f"{path}.{name}" if path else name, self.resolved(content) | {_REQUIRED: required})

    def definition(self, name: str) -> Schema:
        """Return a definition of the schema."""
        found: Schema = self._schema["$defs"][name]
        return found

    def resolved(self, content: Schema) -> Schema:
        """Return a property with the definition that it refers to merged in; its own description wins."""
        for reference in (content.get("$ref"), *(one.get("$ref") for one in content.get("anyOf", ()))):
            if reference and (name := reference.rsplit("/", 1)[-1]) not in self._apart:
                return {**self.definition(name), **content}
        return content

    def _key(self, path: str, content: Schema) -> Iterator[Key]:
        inner = entry_of(content)
        variants = [self.resolved(one) for one in content.get("oneOf", ())]
        if inner is not None:
            yield Key(path, content)
            yield from self.keys(self.resolved(inner), f"{path}.NAME")
        elif variants:
            yield from self._forms(path, content, variants)
        elif "properties" in content:
            yield from self.keys(content, path)
        elif "properties" in (entry := self.resolved(content.get("items", {}))):
            yield Key(path, {**content, "items": {"type": "entries below"}})
            yield from self.keys(entry, f"{path}.N")
        else:
            yield Key(path, content)

    def _forms(self, path: str, content: Schema, variants: list[Schema]) -> Iterator[Key]:
        """Yield the key that tells several forms apart, then those of each form."""
        tag = content["discriminator"]["propertyName"]
        forms = {one["properties"][tag]["const"]: one for one in variants}
        texts = "; ".join(f"{form}: {one['description'].rstrip('.')}" for form, one in forms.items())
        default = next(iter(forms))
        yield Key(f"{path}.{tag}", {"enum": list(forms), "default": default, "description": f"{texts}."})
        for form, one in forms.items():
            for key in self.keys(one, path):
                if key.path != f"{path}.{tag}":
                    yield Key(key.path, {**key.schema, "description": f"{form}: {key.schema['description']}"})


def entry_of(content: Schema) -> Schema | None:
    """Return the schema of the entries of a mapping from names, None for everything else."""
    named = [*content.get("patternProperties", {}).values(), content.get("additionalProperties")]
    return next((entry for entry in named if isinstance(entry, dict)), None)


def keys_table(keys: Iterable[Key]) -> str:
    """Return the table of some keys."""
    return table(("key", "values", "default", "meaning"), (key.row for key in keys))


def _default(schema: Schema) -> str:
    if schema.get(_REQUIRED):
        return "required"
    value = schema.get("default")
    if value in (None, "", {}, []):
        return "none"
    return code(value if isinstance(value, str) else json.dumps(value))


def type_of(schema: Schema) -> str:
    """Return type and range in words."""
    if "const" in schema:
        return code(schema["const"])
    if "enum" in schema:
        return ", ".join(code(value) for value in schema["enum"])
    variants = [one for one in schema.get("anyOf", ()) if one.get("type") != "null"]
    if variants:
        return " or ".join("mapping" if "$ref" in one else type_of(one) for one in variants)
    kind = str(schema.get("type", "mapping")).replace("object", "mapping")
    if kind == "array":
        return _array(schema)
    if kind == "string":
        return (
            "name" if str(schema.get("pattern", "")).startswith(_NAME_PATTERN_START) else schema.get("format", "text")
        )
    return {"boolean": "`true`, `false`"}.get(kind, f"{kind}{_range(schema)}")


def _array(schema: Schema) -> str:
    if entries := schema.get("prefixItems"):
        return f"{len(entries)} x {type_of(entries[0])}"
    return f"list of {type_of(schema['items'])}"


def _range(schema: Schema) -> str:
    if "minimum" in schema and "maximum" in schema:
        return f" {schema['minimum']:g} to {schema['maximum']:g}"
    words = {
        "minimum": "from {:g}",
        "exclusiveMinimum": "above {:g}",
        "maximum": "up to {:g}",
        "exclusiveMaximum": "below {:g}",
    }
    return "".join(f" {text.format(schema[word])}" for word, text in words.items() if word in schema)
