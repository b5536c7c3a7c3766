"""JSON Schema of a field file as written (with its three levels), for editors that complete and check it."""

from typing import Any

from groundstation.settings.drones import Drone, OnboardCameraSettings
from groundstation.settings.levels import FIXED
from groundstation.settings.room import CalibrationSettings, WorldCameraSettings
from groundstation.settings.schema import Field

_DIALECT = "https://json-schema.org/draft/2020-12/schema"
_CALIBRATION = CalibrationSettings.__name__


def field_file_schema() -> dict[str, Any]:
    """Return the schema: that of the resolved field, plus `defaults`, `types` and names of calibration files."""
    schema = Field.model_json_schema(mode="validation")
    definitions: dict[str, Any] = schema["$defs"]
    for owner in (WorldCameraSettings, OnboardCameraSettings):
        definitions[owner.__name__]["properties"]["calibration"] = {
            "description": "Name of a calibration file beside the field file, or its content.",
            "anyOf": [{"type": "string"}, {"$ref": f"#/$defs/{_CALIBRATION}"}],
        }
    # Any part of a drone may stand at any level, so no level alone has required keys.
    for name in _parts_of_drone(definitions, Drone.__name__):
        definitions[name].pop("required", None)
    drone = definitions[Drone.__name__]
    level = {**drone, "title": "Level", "description": "What several drones share; a drone's own entry wins."}
    definitions["Level"] = level
    drone["properties"] = {
        "type": {"type": "string", "description": "Entry of `types` whose settings this drone starts from."}
    } | drone["properties"]
    reference = {"$ref": "#/$defs/Level"}
    schema["properties"] |= {
        "defaults": {**reference, "description": "Settings of every drone, unless its type or its own entry differs."},
        "types": {
            "type": "object",
            "additionalProperties": reference,
            "description": "Settings of a type of drone, by the name that drones give as their type.",
        },
    }
    schema["required"] = sorted({*schema["required"], "schema_version"})
    schema["anyOf"] = [{"required": ["target"]}, {"required": ["targets"]}]
    schema["allOf"] = [{"anyOf": [{"required": [section]} for section in FIXED]}]
    return {"$schema": _DIALECT, **schema, "title": "Field file"}


def _parts_of_drone(definitions: dict[str, Any], name: str) -> set[str]:
    """Return the definitions below one, without Calibration, which is a file of its own."""
    found = {name}
    for inner in _references(definitions[name]):
        if inner not in (_CALIBRATION, *found):
            found |= _parts_of_drone(definitions, inner)
    return found


def _references(node: Any) -> list[str]:
    if isinstance(node, dict):
        own = [node["$ref"].rsplit("/", 1)[-1]] if "$ref" in node else []
        return own + [name for value in node.values() for name in _references(value)]
    if isinstance(node, list):
        return [name for value in node for name in _references(value)]
    return []
