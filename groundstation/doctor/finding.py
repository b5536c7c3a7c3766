"""One finding of the doctor."""

from enum import StrEnum
from typing import NamedTuple


class Level(StrEnum):
    """Level of a finding: MUST is to be mended before a flight, SHOULD makes flights worse, OK needs nothing."""

    MUST = "MUST"
    SHOULD = "SHOULD"
    OK = "OK"


class Finding(NamedTuple):
    """A finding: its subject, its text, and its remedy, "" if none is needed."""

    level: Level
    subject: str
    found: str
    remedy: str = ""


def judged(good: bool, otherwise: Level, subject: str, found: str, remedy: str) -> Finding:
    """Return an OK finding, or one of the other level with its remedy."""
    return Finding(Level.OK, subject, found) if good else Finding(otherwise, subject, found, remedy)
