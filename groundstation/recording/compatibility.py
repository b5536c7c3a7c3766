"""Checks that Skein wrote a recording, with messages that this program understands."""

from groundstation.errors import OperatorMistake

PROFILE = "skein"

# Raise it when a change of `groundstation.bus.messages` makes earlier recordings unreadable (a field that is renamed,
# removed, required from now on, or that changes its meaning); added optional fields need no new number.
MESSAGE_VERSION = 1
VERSION_FIELD = "message_version"


class RecordingError(OperatorMistake):
    """The file is missing, no recording, or unreadable; damage inside a recording of ours is never an error."""


def require_ours(name: str, profile: str, library: str) -> None:
    """Raise RecordingError for an MCAP file that another program has written."""
    if profile != PROFILE:
        by = " ".join(part for part in (f"profile {profile!r}" if profile else "", library and f"by {library}") if part)
        raise RecordingError(
            f"{name}: an MCAP file of another program ({by or 'unnamed'}), not a recording of a ground station; "
            "Foxglove, Lichtblick or `mcap info` open it"
        )


def require_readable(name: str, metadata: dict[str, dict[str, str]]) -> None:
    """Raise RecordingError when the messages are of a version that this program does not know.

    Recordings from before the number was written have version 1.
    """
    version = metadata.get("run", {}).get(VERSION_FIELD, "1")
    if version != str(MESSAGE_VERSION):
        writer = metadata.get("versions", {}).get("skein-groundstation", "an unknown version")
        raise RecordingError(
            f"{name}: recorded with message version {version} by skein-groundstation {writer}; this program reads "
            f"version {MESSAGE_VERSION}. Install skein-groundstation {writer} to read it"
        )
