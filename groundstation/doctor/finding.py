"""One answer of the doctor."""

from enum import StrEnum
from typing import NamedTuple


class Level(StrEnum):
    """How much a finding matters: MUST is mended before a flight, SHOULD makes flights worse, OK needs nothing."""

    MUST = "MUST"
    SHOULD = "SHOULD"
    OK = "OK"


class Finding(NamedTuple):
    """What was looked at, what was found, and what to do about it; `remedy` is empty where nothing is to do."""

    level: Level
    subject: str
    found: str
    remedy: str = ""


def judged(good: bool, otherwise: Level, subject: str, found: str, remedy: str) -> Finding:
    """Return an OK finding, or one of the other level with its remedy."""
    return Finding(Level.OK, subject, found) if good else Finding(otherwise, subject, found, remedy)
