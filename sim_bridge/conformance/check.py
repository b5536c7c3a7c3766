"""The type of a check: a sentence that must hold for every kind of vehicle, its flight, and its function."""

from collections.abc import Callable
from dataclasses import dataclass

from sim_bridge.conformance.record import Record
from sim_bridge.conformance.subject import Subject


class NotApplicable(Exception):
    """The kind lacks the subject of a check, such as a height sensor."""


@dataclass(frozen=True, slots=True)
class Case:
    """The input of a check; the record is empty for checks of the kind's object alone."""

    subject: Subject
    record: Record


@dataclass(frozen=True, slots=True)
class Check:
    """name: its identifier; text: the requirement; flight: its script, "" for the kind's object alone.

    judge: raises AssertionError with the actual result, or NotApplicable.
    """

    name: str
    text: str
    flight: str
    judge: Callable[[Case], None]


CHECKS: dict[str, Check] = {}


def check(flight: str = "") -> Callable[[Callable[[Case], None]], Callable[[Case], None]]:
    """Return a decorator that adds a function to the list of checks; its docstring is the sentence."""

    def added(judge: Callable[[Case], None]) -> Callable[[Case], None]:
        text = (judge.__doc__ or "").strip().rstrip(".")
        CHECKS[judge.__name__] = Check(judge.__name__, text, flight, judge)
        return judge

    return added
