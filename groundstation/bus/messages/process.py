"""Lifecycle and events of the processes."""

from enum import StrEnum

from groundstation.bus.messages.base import Message

# The entity of events about a run as a whole. The text of one begins so: the run has ended, and how.
RUN = "run"
RUN_ENDED = "run ended: "
# The last words of such an event, where it is so; where neither is, a drone may fly.
ALL_DOWN = "all drones are on the ground"
SOME_UNHEARD = "not every drone was heard"


class Severity(StrEnum):
    """How much attention an event needs."""

    INFO = "INFO"
    """For the log."""
    WARNING = "WARNING"
    """Something does not work as it should."""
    ERROR = "ERROR"
    """Something has failed."""


class Event(Message, frozen=True, kw_only=True):
    """Something that happened to `header.entity`."""

    severity: Severity
    """How much attention it needs."""
    text: str
    """What happened."""
    remedy: str = ""
    """What the operator can do about it."""
    injected: bool = False
    """Whether a scenario of the simulator causes it: a fault that begins, lasts or ends."""

    @property
    def sentence(self) -> str:
        """Return the text, preceded by the entity unless the text begins with it."""
        entity = self.header.entity
        return self.text if self.text.startswith(entity) else f"{entity}: {self.text}"

    @property
    def ends_run(self) -> bool:
        """Return whether it says that the run has ended."""
        return self.header.entity == RUN and self.text.startswith(RUN_ENDED)


class Lifecycle(StrEnum):
    """States of every process."""

    STARTING = "STARTING"
    """Connects, compiles, loads calibrations."""
    READY = "READY"
    """Does its work."""
    DEGRADED = "DEGRADED"
    """Works, with something missing."""
    STOPPING = "STOPPING"
    """Finishes its work and exits."""


class ProcessStatus(Message, frozen=True, kw_only=True):
    """Lifecycle, CPU use and deadlines of one process (1 Hz)."""

    state: Lifecycle
    """Lifecycle state."""
    pid: int
    """Process id."""
    cpu: float
    """Share of one core since the last status."""
    waited: float = 0.0
    """Share of the time since the last status for which its main thread was ready to run and had no core."""
    others_cpu: float | None = None
    """Cores that other programs of this computer used since the last status; only the supervisor tells it."""
    ticks: int = 0
    """Cycles of its loop so far."""
    overruns: int = 0
    """Cycles that began more than 10 ms late."""
    overflowed: int = 0
    """Messages lost because a queue was full."""
    detail: str = ""
    """What it waits for or lacks, in words."""
