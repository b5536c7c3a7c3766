"""Damaged bus messages, page messages and field files, and the decoders that read them."""

import json
from copy import deepcopy
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

import msgspec
from damage import Random, damaged_bytes, damaged_json

from groundstation.bus import codec, keys
from groundstation.bus.api import Sample, decode_sample
from groundstation.bus.messages import Header
from groundstation.bus.topics import TOPICS, Topic
from groundstation.settings.document import Node, SourceLine, parse
from groundstation.settings.load import field_of_tree
from groundstation.settings.schema import Field

FIELD = Path(__file__).parents[1] / "fixtures" / "field" / "lab.yaml"
# Messages of the bus

HEADER = Header(1_000, "boot", "drone_1", "tracker", 7)


def example(kind: Any) -> Any:
    """Return a value of an annotated type, with all that is optional."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is tuple:
        return (example(arguments[0]),) * 9 if arguments[-1] is Ellipsis else tuple(map(example, arguments))
    if origin is dict:
        return {"a": example(arguments[1])}
    if hasattr(origin, "__origin__") or origin is not None:
        return example(next(a for a in arguments if a is not type(None)))
    if issubclass(kind, Header):
        return HEADER
    if issubclass(kind, msgspec.Struct):
        hints = get_type_hints(kind)
        values = {name: example(hints[name]) for name in kind.__struct_fields__}
        if "covariance" in values and kind.__name__ in ("RelativeObservation", "PoseHypothesis"):
            values["covariance"] = (0.5,) * (9 if values.get("yaw_rad") is None else 16)
        return kind(**values)
    if issubclass(kind, str) and kind is not str:
        return next(iter(kind))
    return {float: 1.5, int: 3, str: "abc", bool: True, bytes: b"\xff\xd8"}[kind]


def _sound(topic: Topic) -> tuple[str, bytes, bytes]:
    key = keys.expression("lab", topic, HEADER.entity, HEADER.source)
    if topic.type is None:
        return key, b"\xff\xd8", codec.encode(HEADER)
    return key, codec.encode(example(topic.type)), b""


SOUND = [_sound(topic) for topic in TOPICS.values()]


def damaged_sample(rng: Random) -> Sample:
    key, payload, attachment = rng.choice(SOUND)
    if rng.random() < 0.1:
        key = bytes(damaged_bytes(rng, key.encode(), b"/*@$")).decode(errors="replace")
    return Sample(key, damaged_json(rng, payload), damaged_json(rng, attachment) if attachment else b"")


def read_sample(sample: Sample) -> None:
    message = decode_sample(sample).message
    if message is not None:
        codec.encode(message)


# Messages of pages

SAID = [
    b'{"type":"hello","token":"abcd","client":"efgh"}',
    b'{"type":"order","verb":"LAND","drones":["drone_1"],"run":"r","at_ms":1.5,"age_ms":2.5,"ref":"1"}',
    b'{"type":"takeover"}',
    b'{"type":"seen","seq":5}',
    b'{"type":"watch","cameras":["a","b"]}',
    b'{"type":"drive","speed_m_s":0.5,"turn_rad_s":1.0,"target":""}',
    b'{"type":"place","x_m":1.0,"y_m":2.0}',
    b'{"type":"seek","at_ms":100.0}',
    b'{"type":"step","ticks":-5}',
]


def damaged_words(rng: Random) -> str | bytes:
    data = damaged_json(rng, rng.choice(SAID))
    return data if rng.random() < 0.2 else data.decode(errors="replace")


# Field files

_LINES = FIELD.read_text(encoding="utf-8").splitlines(keepends=True)
_SMALL = """\
schema_version: 1
site: lab
room: {size_m: [8, 6, 4]}
defaults: {kind: ardrone, limits: {max_speed_m_s: 0.3}}
drones:
  drone_1: {address: 127.0.0.2, pad_m: [0, 0], marker: {code: 1, square_mm: 44, position_m: [0, 0, 0]}}
target: {name: t, marker: {code: 5, height_m: 0.4, square_mm: 44}}
cameras:
  c: {source: "http://127.0.0.3/", mount: {position_m: [0, 0, 4], yaw_deg: 0}}
"""
_YAML = "\t &*!|>-:?[]{}#'\"%@`,~\n 0.e\u2028\x00"
_PLAIN = parse(_SMALL, "f.yaml").plain()
_ODD: tuple[Any, ...] = (
    *(None, True, 0, -1, 1.5, 1e308, float("inf"), float("nan"), 10**400, "", "x", "drone_1", "::", "\U0001f681"),
    *([], {}, [None], [[[1]]], {"x": 1}, {"": {}}, [1, 2, 3], "127.0.0.1", "http://a:b@c/", "2020-01-01"),
)


def _damaged_text(rng: Random) -> str:
    begin = rng.randrange(len(_LINES))
    text = "".join(_LINES[begin : begin + rng.randint(1, 4)])
    for _ in range(rng.randint(1, 4)):
        place = rng.randrange(len(text) or 1)
        end = place + rng.randrange(3)
        text = text[:place] + "".join(rng.choices(_YAML, k=rng.randrange(3))) + text[end:]
    return text


def _damaged_tree(rng: Random) -> Any:
    tree = json.loads(json.dumps(_PLAIN))
    for _ in range(rng.randint(1, 2)):
        inner = tree
        while True:
            keys_of = list(inner) if isinstance(inner, dict) else list(range(len(inner)))
            if not keys_of:
                break
            key = rng.choice(keys_of)
            if not isinstance(inner[key], dict | list) or not inner[key] or rng.random() < 0.15:
                if rng.random() < 0.15:
                    del inner[key]
                elif rng.random() < 0.1 and isinstance(inner, dict):
                    inner[rng.choice(("x", "", "drone_2", "tpye"))] = inner.pop(key)
                else:
                    inner[key] = deepcopy(rng.choice(_ODD))  # later damage must not change the choice itself
                break
            inner = inner[key]
    return tree


def _nodes(value: Any) -> Node:
    inner = value
    if isinstance(value, dict):
        inner = {key: _nodes(entry) for key, entry in value.items()}
    elif isinstance(value, list):
        inner = [_nodes(entry) for entry in value]
    return Node(inner, SourceLine("f.yaml", 1))


def damaged_field(rng: Random) -> Any:
    """Return a piece of text, nine times of ten (the reader of YAML takes a second for 20 fields), or a whole field."""
    return _damaged_text(rng) if rng.random() < 0.9 else _damaged_tree(rng)


def read_field(damaged: Any) -> Field | Node:
    if isinstance(damaged, str):
        return parse(damaged, "f.yaml")
    return field_of_tree(_nodes(damaged), (), FIELD)
