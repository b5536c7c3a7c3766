"""Pages of the keys of field files, calibrations, marker layouts and scenarios."""

from collections.abc import Iterable, Iterator

from groundstation.settings.floor_markers import FloorMarkers
from groundstation.settings.json_schema import field_file_schema
from groundstation.settings.schema import Field
from sim_bridge.scenario import Scenario
from skein_reference.markdown import page, prose
from skein_reference.schema_tables import Key, KeyTables, Schema, entry_of, keys_table

_LEVELS = frozenset({"defaults", "types"})
_CALIBRATION = "CalibrationSettings"


def field_keys() -> str:
    """Return the page of every key of a field file and of the files that belong to it."""
    schema = _as_required(field_file_schema())
    calibration, layout = schema["$defs"][_CALIBRATION], FloorMarkers.model_json_schema()
    return page(
        "Field keys",
        _FIELD_INTRODUCTION,
        *_sections(KeyTables(schema, apart=frozenset({_CALIBRATION})), schema),
        _section("Calibration file", _CALIBRATIONS, KeyTables(schema).keys(calibration)),
        _section("Marker layout", _LAYOUT, KeyTables(layout).keys(layout)),
    )


def scenario_keys() -> str:
    """Return the page of every key of a scenario file."""
    schema = Scenario.model_json_schema()
    return page("Scenario keys", _SCENARIO_INTRODUCTION, *_sections(KeyTables(schema), schema))


def _as_required(schema: Schema) -> Schema:
    """Return a field file's schema with the keys that a merged field must have: no single level must have any."""
    for name, definition in Field.model_json_schema()["$defs"].items():
        schema["$defs"][name]["required"] = definition.get("required", [])
    return schema


def _sections(tables: KeyTables, schema: Schema) -> Iterator[str]:
    """Yield a table for each section of a file, after one for the keys that belong to none."""
    properties = {name: tables.resolved(one) for name, one in schema["properties"].items()}
    single = {name: one for name, one in properties.items() if "properties" not in one and entry_of(one) is None}
    yield _section("Top level", "", tables.keys({**schema, "properties": single}))
    for name, content in properties.items():
        if name in _LEVELS:
            place = name if name == "defaults" else f"{name}.NAME"
            text = f"{content['description']} `{place}` takes the keys of `drones.NAME`, but for `type`."
            yield f"## {name}\n\n{prose(text)}"
        elif name not in single:
            keys = tables.keys({"properties": {name: content}})
            yield _section(name, content["description"], (key for key in keys if key.path != name))


def _section(heading: str, text: str, keys: Iterable[Key]) -> str:
    rows = tuple(keys)  # none: the text says it all
    return "\n\n".join([f"## {heading}", *([prose(text)] if text else []), *([keys_table(rows)] if rows else [])])


_FIELD_INTRODUCTION = """\
Every key of a field file, generated from the settings models. [Your own field](../../tutorials/your-own-field.md)
shows how such a file is made; `groundstation config schema` prints the same as JSON Schema for editors.

Units are part of the names. `NAME` stands for a name of your choice: lower-case letters, digits and `_`, a letter
first. All names of a field differ, and are not those of Skein's own processes: `team`, `tracker`, `router` and so on,
nothing that starts with `sim_` or ends with `_camera`. A drone's required keys may stand at any of its three
levels."""

_CALIBRATIONS = "A file such as cameras/ceiling.yaml, which a camera names as its `calibration`."

_LAYOUT = "A file for `groundstation calibrate extrinsics --markers`: markers at measured places. `N` counts from 0."

_SCENARIO_INTRODUCTION = """\
Every key of a scenario file: what the *simulator* does. Nothing that flies reads it. Units are part of the names; a
pair of numbers is a range from which each drone draws its own value; `NAME` is a drone or target of the field, `N`
counts from 0."""
