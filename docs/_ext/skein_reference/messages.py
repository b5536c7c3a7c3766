"""Page of the topics and of every message on the bus."""

import inspect
import types
import typing
from collections.abc import Iterator
from enum import Enum
from typing import Any

import msgspec

from groundstation.bus import topics
from groundstation.bus.messages import Header
from groundstation.bus.topics import TOPICS, Plane, Quality, Topic
from skein_reference.attribute_texts import attribute_texts, first_sentence
from skein_reference.markdown import code, page, prose, table

_INTRODUCTION = """\
Generated from the table of topics and the message types. Messages are JSON on the bus and in the recording; numbers are
finite, unknown values are `null`. Frames and units are explained in the [glossary](../../glossary.md).

A topic's key is `gs/@v1/SITE/ENTITY/TOPIC/SOURCE`; ground truth and simulator control have `@truth` and `@sim` before
the entity, where no production wildcard matches them. Everything is dropped rather than queued without bound."""


def messages() -> str:
    """Return the page."""
    planes = [_plane(plane) for plane in Plane]
    texts = attribute_texts(Quality)
    classes = table(("class", "used for"), [(code(one), prose(texts[one.name])) for one in Quality])
    parts = [_INTRODUCTION, "## Topics", *planes, "### Delivery classes", classes, "## Messages"]
    return page("Messages", *parts, *(_type(kind) for kind in documented_types()))


def _plane(plane: Plane) -> str:
    title = f"### {plane.value or 'Production'}\n\n{prose(attribute_texts(Plane)[plane.name])}\n\n"
    return title + table(
        ("topic", "message", "rate [Hz]", "delivery", "may be published by", "what it is"),
        [_row(topic) for topic in TOPICS.values() if topic.plane is plane],
    )


def _row(topic: Topic) -> tuple[str, ...]:
    (constant,) = (name for name, value in vars(topics).items() if value is topic)
    kind = _link(topic.type) if topic.type else f"bytes, {topic.encoding}"
    rate = f"{topic.rate_hz:g}" if topic.rate_hz else "on occasion"
    senders = ", ".join(sorted(topic.senders)) or "nobody"
    return code(topic.name), kind, rate, topic.quality.value, senders, prose(attribute_texts(topics).get(constant, ""))


def documented_types() -> list[type[Any]]:
    """Return the header, the message type of every topic, and every type that they are made of, each once."""
    found: dict[type[Any], None] = {}
    kinds: list[type[Any]] = [Header, *(topic.type for topic in TOPICS.values() if topic.type)]
    for kind in kinds:
        found |= dict.fromkeys(_made_of(kind))
    return list(found)


def _made_of(kind: type[Any]) -> Iterator[type[Any]]:
    yield kind
    if issubclass(kind, msgspec.Struct):
        for hint in typing.get_type_hints(kind).values():
            for inner in _classes(hint):
                if issubclass(inner, msgspec.Struct | Enum):
                    yield from _made_of(inner)


def _classes(hint: Any) -> Iterator[type[Any]]:
    if isinstance(hint, type) and not typing.get_args(hint):
        yield hint
    for argument in typing.get_args(hint):
        yield from _classes(argument)


def _type(kind: type[Any]) -> str:
    body = _values(kind) if issubclass(kind, Enum) else _fields(kind)
    return f"### {kind.__name__}\n\n{prose(first_sentence(kind))}\n\n{body}"


def _values(kind: type[Enum]) -> str:
    texts = attribute_texts(kind)
    return table(("value", "meaning"), [(code(one.value), prose(texts.get(one.name, ""))) for one in kind])


def _fields(kind: type[msgspec.Struct]) -> str:
    texts, hints = attribute_texts(kind), typing.get_type_hints(kind)
    fields = [field for field in msgspec.structs.fields(kind) if field.name != "header"]
    rows = [(code(one.name), _words(hints[one.name]), _default(one), prose(texts.get(one.name, ""))) for one in fields]
    return table(("field", "type", "default", "meaning"), rows)


def _default(field: msgspec.structs.FieldInfo) -> str:
    if field.default_factory is not msgspec.NODEFAULT:
        return code(msgspec.json.encode(field.default_factory()).decode())
    if field.default is msgspec.NODEFAULT:
        return "required"
    return code(msgspec.json.encode(field.default).decode())


def _link(kind: type[Any]) -> str:
    return f"[{kind.__name__}](#{kind.__name__.lower()})"


def _words(hint: Any) -> str:
    """Return a type in words: `3 x number`, `list of Edge`, `number or null`."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return " or ".join(map(_words, arguments))
    if origin is tuple:
        every = len(arguments) == 2 and arguments[1] is Ellipsis
        if every:
            return f"list of {_words(arguments[0])}"
        same = len(set(arguments)) == 1
        return f"{len(arguments)} x {_words(arguments[0])}" if same else f"({', '.join(map(_words, arguments))})"
    if origin is dict:
        return f"{_words(arguments[1])} by {_words(arguments[0])}"
    if inspect.isclass(hint) and issubclass(hint, msgspec.Struct | Enum):
        return _link(hint)
    return {float: "number", int: "integer", str: "text", bool: "true, false", type(None): "null"}.get(hint, str(hint))
