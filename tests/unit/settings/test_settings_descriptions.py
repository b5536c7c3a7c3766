"""Every key of a field file has a description in the editors' schema, and so in the generated reference."""

import json
from collections.abc import Iterator
from typing import Any

import pytest
from click.testing import CliRunner

from groundstation.cli.config import schema as schema_command
from groundstation.settings.json_schema import field_file_schema


def keys_of(schema: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield path and content of every property, at any depth."""
    for name, part in [("", schema), *schema.get("$defs", {}).items()]:
        for key, content in part.get("properties", {}).items():
            yield f"{name}.{key}", content


def printed_schema() -> dict[str, Any]:
    result = CliRunner().invoke(schema_command, standalone_mode=False)
    printed: dict[str, Any] = json.loads(result.output)
    return printed


def test_the_printed_schema_explains_every_key() -> None:
    keys = dict(keys_of(printed_schema()))
    assert len(keys) > 150
    bare = [path for path, content in keys.items() if len(content.get("description", "")) < 15]
    assert not bare, f"put a text below these keys in groundstation/settings: {bare}"


def test_every_section_says_what_it_is() -> None:
    definitions = field_file_schema()["$defs"]
    assert not [name for name, part in definitions.items() if not part.get("description")]


@pytest.mark.parametrize(
    ("suffix", "unit"),
    [("_m", "[m"), ("_m_s", "[m/s]"), ("_s", "[s]"), ("_ms", "[ms]"), ("_deg", "[deg"), ("_mm", "[mm]")],
)
def test_a_description_gives_the_unit_of_its_key(suffix: str, unit: str) -> None:
    """`_s` is a second, but not as the end of `_m_s` and `_deg_s`."""
    others = {"_s": ("_m_s", "_deg_s")}.get(suffix, ())
    keys = [(path, content["description"]) for path, content in keys_of(field_file_schema())]
    wrong = [
        path
        for path, text in keys
        if path.endswith(suffix) and not path.endswith(others) and unit not in text and f" in {unit[1:]}" not in text
    ]
    assert not wrong, wrong
