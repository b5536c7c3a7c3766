"""Marks recordings that are stretches cut out of another one: a part of a flight is not judged as a flight."""

from collections.abc import Mapping
from pathlib import Path

import msgspec

from groundstation.recording.reader import RecordingError, open_recording
from groundstation.time_units import NS_PER_S

_RECORD = "cut"


class Stretch(msgspec.Struct, frozen=True):
    """Begin and end of the stretch [UNIX ns]."""

    from_unix_ns: int
    until_unix_ns: int

    @property
    def kind(self) -> str:
        """Return the one word for it."""
        return "cut"

    @property
    def sentence(self) -> str:
        """Return a sentence that distinguishes a cut from a flight, and limits the meaning of its figures."""
        duration_s = (self.until_unix_ns - self.from_unix_ns) / NS_PER_S
        return f"cut of {duration_s:.1f} s from a recording: a part of a flight, so nothing is judged"

    def as_metadata(self) -> dict[str, dict[str, str]]:
        """Return the metadata record that marks a recording as this stretch."""
        return {_RECORD: {"from_unix_ns": str(self.from_unix_ns), "until_unix_ns": str(self.until_unix_ns)}}


def stretch_of(metadata: Mapping[str, Mapping[str, str]]) -> Stretch | None:
    """Return the stretch that a recording is, by its metadata; None for a whole one."""
    record = metadata.get(_RECORD)
    if record is None:
        return None
    ends = (record.get(name, "") for name in ("from_unix_ns", "until_unix_ns"))
    return Stretch(*(int(end) if end.isdecimal() else 0 for end in ends))


def is_stretch(path: Path) -> bool:
    """Return whether a file is known to have been cut out of another one."""
    try:
        return stretch_of(open_recording(path).metadata) is not None
    except RecordingError:
        return False
