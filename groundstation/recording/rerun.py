"""Marks recordings that are re-runs: a tracker processed a flight again; no drone flew, so nothing is judged."""

from collections.abc import Mapping

import msgspec

_RECORD = "replay"


class Rerun(msgspec.Struct, frozen=True):
    """The origin of a re-run. changes: changed settings, in words ("": only the tracker's version)."""

    of: str
    changes: str = ""

    @property
    def kind(self) -> str:
        """Return the one word for it."""
        return "what-if" if self.changes else "re-run"

    @property
    def mark(self) -> str:
        """Return the mark over every view of it."""
        return f"{self.kind.upper()}, not flown"

    @property
    def subject(self) -> str:
        """Return the recording that it repeats, and with which settings, in words."""
        how = f"with {self.changes}" if self.changes else "with its own settings"
        return f"{self.kind} of {self.of} {how}"

    @property
    def sentence(self) -> str:
        """Return a sentence that distinguishes a re-run from a flight, and limits the meaning of its figures."""
        return (
            f"{self.subject}: no flight, so nothing is judged; estimates and plans were computed, "
            "vehicles, safety and processes are those of the recorded flight"
        )

    def as_metadata(self) -> dict[str, dict[str, str]]:
        """Return the metadata record that marks a recording as this re-run."""
        return {_RECORD: {"of": self.of, "changes": self.changes}}


def rerun_of(metadata: Mapping[str, Mapping[str, str]]) -> Rerun | None:
    """Return the re-run that a recording is, by its metadata; None for a flight."""
    record = metadata.get(_RECORD)
    return None if record is None else Rerun(record.get("of", "a recording"), record.get("changes", ""))
