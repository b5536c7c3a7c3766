"""Every recorded message type has a schema that viewers can read and that matches its encoding."""

import json
from enum import StrEnum
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import msgspec
import pytest

from groundstation.bus.messages.belief import SearchMap
from groundstation.bus.topics import IMAGE, TOPICS, VIDEO, Topic
from groundstation.recording.file_topics import DATAGRAM_TOPICS, IMAGE_TOPICS, STATE_TOPICS
from groundstation.recording.schemas import description_of, recorded_type, viewer_schema

ALL = list(TOPICS.values())
SQUARE = ("Odometry", "RelativeObservation", "RangeObservation", "PoseHypothesis")


def _example(kind: Any, *, full: bool) -> Any:
    """Return a value of an annotated type: with `full`, optional fields are set and tuples are not empty."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return _example(next(a for a in arguments if a is not type(None)), full=full) if full else None
    if origin is tuple:
        if arguments[-1] is Ellipsis:
            return (_example(arguments[0], full=full),) * (9 if full else 0)
        return tuple(_example(argument, full=full) for argument in arguments)
    if origin is dict:
        return {"a": 1} if full else {}
    if isinstance(kind, type) and issubclass(kind, StrEnum):
        return next(iter(kind))
    if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        hints = get_type_hints(kind)
        values = {name: _example(hints[name], full=full) for name in kind.__struct_fields__}
        for name in ("velocity_covariance", "covariance"):
            if name in values and kind.__name__ in SQUARE:
                size = 9 if name == "velocity_covariance" or values.get("yaw_rad") is None else 16
                values[name] = (0.0,) * size
        if kind is SearchMap:
            values["chances"] = (3,) * values["columns"]
        return kind(**values)
    return {float: 1.5, int: 3, str: "abc", bool: True, bytes: b"\xff\xd8"}[kind]


def _check(value: Any, schema: dict[str, Any], path: str) -> None:
    if value is None:
        assert schema.get("nullable"), path
        return
    types: dict[str, Any] = {
        "string": str,
        "integer": int,
        "number": (int, float),
        "boolean": bool,
        "object": dict,
        "array": list,
    }
    assert isinstance(value, types[schema["type"]]), path
    assert "enum" not in schema or value in schema["enum"], path
    if schema["type"] == "object":
        assert set(schema.get("required", ())) <= set(value), path
        for name, field in schema["properties"].items():
            if name in value:
                _check(value[name], field, f"{path}.{name}")
    if schema["type"] == "array":
        assert schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", 10**9), path
        for item in value:
            _check(item, schema["items"], f"{path}[]")


def _assert_typable(schema: dict[str, Any], path: str) -> None:
    # The subset accepted by Lichtblick's and Foxglove's schema parser: every field a plain type, items never arrays.
    assert schema["type"] in ("boolean", "string", "number", "integer", "object", "array"), path
    assert not {"$ref", "anyOf", "oneOf", "prefixItems"} & set(schema), path
    if schema["type"] == "object":
        for name, field in schema["properties"].items():
            _assert_typable(field, f"{path}.{name}")
    if schema["type"] == "array":
        assert schema["items"]["type"] != "array", path
        _assert_typable(schema["items"], f"{path}[]")


@pytest.mark.parametrize("topic", [*STATE_TOPICS, *DATAGRAM_TOPICS], ids=lambda topic: f"{topic.plane}{topic.name}")
def test_schema_is_typable_and_fits_its_own_encoding(topic: Topic) -> None:
    kind = recorded_type(topic)
    schema = json.loads(viewer_schema(kind))
    _assert_typable(schema, kind.__name__)
    for full in (True, False):
        _check(json.loads(msgspec.json.encode(_example(kind, full=full))), schema, kind.__name__)


def test_schema_names_are_unique_and_pictures_have_the_well_known_one() -> None:
    described = {(recorded_type(topic), description_of(topic)) for topic in ALL if topic not in IMAGE_TOPICS}
    assert len({description.schema_name for _, description in described}) == len(described)
    assert description_of(IMAGE).schema_name == "foxglove.CompressedImage"
    assert description_of(VIDEO).schema_name == "foxglove.CompressedVideo"


def test_every_topic_of_every_plane_is_recorded_once() -> None:
    recorded = [*STATE_TOPICS, *IMAGE_TOPICS, *DATAGRAM_TOPICS]
    assert sorted(recorded, key=repr) == sorted(ALL, key=repr)
