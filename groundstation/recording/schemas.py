"""JSON Schemas of all messages in the narrow form that Foxglove, Lichtblick and PlotJuggler can type.

Those viewers know neither `$ref` nor `anyOf` nor tuples nor a field without `type`; one such field and the whole
channel stays unreadable. So references are written out, an optional field has its plain type with `nullable`
(as in OpenAPI 3.0), and a field they have no type for (an array of arrays) is left out of `properties`.
"""

import json
from dataclasses import dataclass
from functools import cache
from typing import Any

import msgspec

from groundstation.bus.messages import Header, Message
from groundstation.bus.topics import Topic
from groundstation.recording.file_topics import is_picture
from groundstation.recording.viewers import viewer_descriptor

JsonSchema = dict[str, Any]
ENCODING = "jsonschema"
NAMESPACE = "skein"


class Datagram(msgspec.Struct, frozen=True):
    """Bytes exactly as they crossed a link, base64 in JSON."""

    header: Header
    data: bytes


RecordedType = type[Message] | type[Datagram]


@dataclass(frozen=True, slots=True)
class Description:
    """The encoding of a channel's messages, in MCAP's terms."""

    message_encoding: str
    schema_name: str
    schema_encoding: str
    schema: bytes


def recorded_type(topic: Topic) -> RecordedType:
    """Return the type of a topic's JSON entries in a recording (pictures are not JSON)."""
    return topic.type or Datagram


@cache
def description_of(topic: Topic) -> Description:
    """Return the encoding of a topic of the bus."""
    if is_picture(topic):
        return well_known(
            "foxglove.CompressedVideo" if topic.encoding.startswith("video/") else "foxglove.CompressedImage"
        )
    kind = recorded_type(topic)
    return Description("json", f"{NAMESPACE}.{kind.__name__}", ENCODING, viewer_schema(kind))


@cache
def well_known(name: str) -> Description:
    """Return the encoding of a Foxglove type."""
    return Description("protobuf", name, "protobuf", viewer_descriptor(name))


@cache
def viewer_schema(kind: RecordedType) -> bytes:
    """Return the JSON Schema of a recorded type, written out for viewers."""
    root = msgspec.json.schema(kind)
    return json.dumps(_inline(root, root.get("$defs", {}))).encode()


def _inline(schema: JsonSchema, definitions: JsonSchema) -> JsonSchema:
    schema = _resolve(schema, definitions)
    if "anyOf" in schema:
        return _nullable(schema["anyOf"], definitions)
    if "enum" in schema:
        return {"type": "string", "enum": schema["enum"]}
    match schema.get("type"):
        case "object":
            return _object(schema, definitions)
        case "array":
            return _array(schema, definitions)
    return {key: value for key, value in schema.items() if key in ("type", "contentEncoding")}


def _resolve(schema: JsonSchema, definitions: JsonSchema) -> JsonSchema:
    while "$ref" in schema:
        schema = definitions[schema["$ref"].removeprefix("#/$defs/")]
    return schema


def _nullable(choices: list[JsonSchema], definitions: JsonSchema) -> JsonSchema:
    (plain,) = (choice for choice in choices if choice.get("type") != "null")
    return _inline(plain, definitions) | {"nullable": True}


def _object(schema: JsonSchema, definitions: JsonSchema) -> JsonSchema:
    fields = {name: _inline(field, definitions) for name, field in schema.get("properties", {}).items()}
    written: JsonSchema = {
        "type": "object",
        "properties": {name: field for name, field in fields.items() if not _is_nested_array(field)},
    }
    for key in ("title", "description", "required"):
        if key in schema:
            written[key] = schema[key]
    if isinstance(schema.get("additionalProperties"), dict):
        written["additionalProperties"] = _inline(schema["additionalProperties"], definitions)
    return written


def _is_nested_array(field: JsonSchema) -> bool:
    return field.get("type") == "array" and field["items"].get("type") in ("array", None)


def _array(schema: JsonSchema, definitions: JsonSchema) -> JsonSchema:
    bounds: JsonSchema = {key: schema[key] for key in ("minItems", "maxItems") if key in schema}
    if "prefixItems" not in schema:
        return {"type": "array", "items": _inline(schema["items"], definitions), **bounds}
    items = [_inline(item, definitions) for item in schema["prefixItems"]]
    same = all(item == items[0] for item in items)
    return {"type": "array", "items": items[0] if same else {}, **bounds}
