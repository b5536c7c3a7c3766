"""Runs without a flight: a check before a take-off, or one in which no drone took off. Neither passed nor failed."""

import msgspec

from groundstation.report.run_facts import RunFacts


class NotFlown(msgspec.Struct, frozen=True):
    """A run without a flight. kind: one word or two for it; sentence: in words, beginning with the kind."""

    kind: str
    sentence: str

    @property
    def told_of(self) -> str:
        """Return what follows the name of the run in a sentence."""
        return f"is a {self.sentence}" if self == A_CHECK else f"was {self.sentence}"


A_CHECK = NotFlown("check", "check before a take-off, in which no drone flies: nothing is judged")
NOBODY_FLEW = NotFlown("not flown", "not flown, as no drone took off: nothing is judged")


def not_flown(facts: RunFacts, *, flew: bool, failed: bool) -> NotFlown | None:
    """Return how a run is none of a flight, or None if it is to be judged.

    failed: a failure ended it, or its recording breaks off. Without a take-off that is judged, as is a run to which a
    time of tracking was promised.
    """
    if facts.is_check:
        return A_CHECK
    return None if flew or failed or facts.tracking_s is not None else NOBODY_FLEW
