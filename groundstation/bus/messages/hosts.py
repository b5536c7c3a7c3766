"""Messages between a run's host and the other hosts of its devices."""

from enum import StrEnum

from groundstation.bus.messages.base import Message, Whole
from groundstation.bus.messages.process import Lifecycle


class Supervision(StrEnum):
    """State of the run's supervisor, as reported to other hosts."""

    WATCHES = "WATCHES"
    """It watches over the run."""
    SILENT = "SILENT"
    """It is frozen: drivers hover, and land after a while."""
    ENDS = "ENDS"
    """It stops the run, or is dead: drivers land and end."""


class HostOrder(Message, frozen=True, kw_only=True):
    """The devices of another host (once a second, until that host reports the run)."""

    run: str
    """Name of the run."""
    version: str
    """Version of the ground station on the run's host; the other host must have the same."""
    field: str
    """The field as JSON, from which the host makes the sections of its devices; passwords are not in it."""


class HostReport(Message, frozen=True, kw_only=True):
    """Sign of life of another host, and a question for the time (20 Hz)."""

    run: str = ""
    """The run whose devices it serves; empty: none."""
    state: Lifecycle = Lifecycle.STARTING
    """READY: all of its processes are."""
    detail: str = ""
    """What it waits for or lacks, in words."""
    sent_ns: Whole
    """When it was sent, on the host's own boot clock [ns]."""
    instance: str = ""
    """Which process it is; two may have been started under one name."""


class HostAnswer(Message, frozen=True, kw_only=True):
    """Answer to a host's report: the run's clock and supervisor. `header.stamp_ns` says when it was sent."""

    supervision: Supervision
    """State of the run's supervisor."""
    sent_ns: Whole
    """Of the report: when it was sent [ns; that host's own boot clock]."""
    received_ns: Whole
    """When the report arrived [ns; header.clock]."""
    instance: str = ""
    """Of the report: which process is answered."""


class ClockOffset(Message, frozen=True, kw_only=True):
    """Offset between two clocks, measured by round trips (1 Hz)."""

    of: str
    """The other clock."""
    offset_ns: int
    """To be added to its stamps to read them on `header.clock` [ns]."""
    error_ns: int = 0
    """Largest possible error of the offset [ns], if no clock has just begun to run off by more than 500 ppm."""
