"""The generated reference is complete, and every entry has a description."""

import re
from pathlib import Path
from typing import Any

import click
import pytest

import skein_reference
from groundstation.bus import messages as bus_messages
from groundstation.bus import topics
from groundstation.bus.topics import TOPICS
from groundstation.cli import main as cli
from groundstation.cli.exits import ExitCode
from groundstation.cli.verbs import all_verbs
from groundstation.settings.json_schema import field_file_schema
from sim_bridge.scenario import Scenario
from skein_reference.attribute_texts import attribute_texts
from skein_reference.commands import contexts
from skein_reference.import_graph import import_graph, layers, reduced
from skein_reference.messages import documented_types

ROW = re.compile(r"^\| (?P<first>[^|]+) \|.*\| (?P<last>[^|]*) \|$", re.M)


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("generated")
    skein_reference.write(folder)
    return {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir()}


def rows(page: str) -> dict[str, str]:
    """Return first and last cell of each row of all tables, without the headings."""
    cells = [(found["first"].strip(), found["last"].strip()) for found in ROW.finditer(page.replace(r"\|", "¦"))]
    return {first: last for first, last in cells if first.startswith("`")}


@pytest.mark.parametrize(
    ("page", "schema"), [("field-keys.md", field_file_schema()), ("scenario-keys.md", Scenario.model_json_schema())]
)
def test_every_key_is_in_its_page_and_explained(pages: dict[str, str], page: str, schema: dict[str, Any]) -> None:
    keys = {key for definition in schema["$defs"].values() for key in definition.get("properties", ())}
    found = rows(pages[page])
    shown = {part for first in found for part in first.strip("`").split(".")}
    assert keys - shown == set()
    assert [first for first, last in found.items() if len(last) < 10] == []


def test_every_message_and_topic_is_in_its_page(pages: dict[str, str]) -> None:
    page = pages["messages.md"]
    found = rows(page)
    assert [topic.name for topic in TOPICS.values() if f"`{topic.name}`" not in found] == []
    types = {name for name in bus_messages.__all__ if isinstance(getattr(bus_messages, name), type)} - {"Message"}
    assert [name for name in sorted(types) if f"\n### {name}\n" not in page] == []


def test_every_field_of_a_message_and_every_topic_has_a_text() -> None:
    bare = []
    for kind in documented_types():
        names = getattr(kind, "__struct_fields__", None) or list(getattr(kind, "__members__", ()))
        bare += [f"{kind.__name__}.{name}" for name in names if name not in attribute_texts(kind)]
    constants = {name for name, value in vars(topics).items() if isinstance(value, topics.Topic)}
    assert bare + sorted(constants - attribute_texts(topics).keys()) == []


def test_every_command_and_option_is_in_its_page_and_explained(pages: dict[str, str]) -> None:
    page = pages["commands.md"]
    for context in contexts(click.Context(cli.groundstation, info_name="groundstation")):
        assert f" {context.command_path}\n" in page
        assert context.command.help, context.command_path
        bare = [one.name for one in context.command.params if isinstance(one, click.Option) and not one.help]
        assert not bare, f"{context.command_path}: {bare}"
    assert all(f"\n## groundstation {verb}\n" in page for verb in all_verbs())


def test_every_exit_code_is_in_its_page(pages: dict[str, str]) -> None:
    assert [
        code for code in ExitCode if f"| `{int(code)}` | `{code.name}` | {code.meaning} |" not in pages["exit-codes.md"]
    ] == []


def test_a_setting_in_the_page_of_failsafes_gives_the_time_beside_it(pages: dict[str, str]) -> None:
    lasting = {line.split(" | ")[3] for line in pages["failsafes.md"].splitlines() if line.startswith("| ")}
    assert {one for one in lasting if "`" in one} == {
        "3.0 s (`safety.land_after_s`)",
        "2.7 s (`safety.land_after_s` - 0.3 s)",
        "10.0 s (`safety.unseen_land_after_s`)",
        "3.0 s (`limits.battery_hold_s`)",
    }


def test_packages_import_each_other_in_no_circle() -> None:
    graph = import_graph()
    order = [node for layer in layers(graph) for node in layer]
    assert {"groundstation.bus", "groundstation.cli", "drivers.ardrone", "sim_bridge"} <= set(order)
    assert all(order.index(other) < order.index(node) for node in graph for other in graph[node])
    assert reduced({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == {"a": {"b"}, "b": {"c"}, "c": set()}
    with pytest.raises(ValueError, match="a -> b -> a"):
        layers({"a": {"b"}, "b": {"a"}})


def test_pages_are_written_once_and_strangers_removed(tmp_path: Path) -> None:
    skein_reference.write(tmp_path)
    (tmp_path / "renamed.md").write_text("a page of yesterday", encoding="utf-8")
    times = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir() if path.name != "renamed.md"}
    skein_reference.write(tmp_path)
    assert {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()} == times
