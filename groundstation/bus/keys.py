"""Zenoh key expressions `gs/@v1/{site}/[@plane/]{entity}/{topic}/{source}`."""

import re
from dataclasses import dataclass
from functools import lru_cache

from groundstation.bus.topics import TOPICS, Plane, Topic
from groundstation.errors import MessageError

NAME_PATTERN = re.compile(r"[a-z][a-z0-9_]{0,47}")
_ROOT = "gs/@v1"


@dataclass(frozen=True, slots=True)
class Key:
    """A parsed key: where a message belongs and who sent it."""

    site: str
    entity: str
    topic: Topic
    source: str

    def __str__(self) -> str:
        return expression(self.site, self.topic, self.entity, self.source)


def expression(site: str, topic: Topic, entity: str = "*", source: str = "*") -> str:
    """Return the key, or the subscription expression where entity or source is a star."""
    plane = f"{topic.plane}/" if topic.plane else ""
    return f"{_ROOT}/{site}/{plane}{entity}/{topic.name}/{source}"


def plane_expression(site: str, plane: Plane) -> str:
    """Return the expression of all keys in one plane of a site, and none in others."""
    return "/".join((_ROOT, site, *([plane.value] if plane else []), "**"))


@lru_cache(maxsize=1024)  # a process hears the same few keys all the time
def parse(text: str) -> Key:
    """Return the parts of a concrete key.

    Raises MessageError for wildcards, keys outside the table and invalid names: any peer may put on a wildcard
    (docs/reference/zenoh.md 3), and a name may appear on the operator's terminal.
    """
    if "*" in text:
        raise MessageError("wildcard_key", text)
    parts = text.split("/")
    if parts[:2] != _ROOT.split("/") or len(parts) not in (6, 7):
        raise MessageError("foreign_key", text)
    site, *plane, entity, name, source = parts[2:]
    try:
        topic = TOPICS[Plane(plane[0] if plane else ""), name]
    except (ValueError, KeyError):
        raise MessageError("unknown_topic", text) from None
    if not (NAME_PATTERN.fullmatch(entity) and NAME_PATTERN.fullmatch(source)):
        raise MessageError("foreign_key", text)
    return Key(site, entity, topic, source)
