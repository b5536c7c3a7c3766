"""Life of the processes."""

from enum import StrEnum

from groundstation.bus.messages.base import Message


class Severity(StrEnum):
    """How loud an event is."""

    INFO = "INFO"
    WARNING = "WARNING"
    ERROR = "ERROR"


class Event(Message, frozen=True, kw_only=True):
    """Something that happened, about header.entity, with what the operator can do about it."""

    severity: Severity
    text: str
    remedy: str = ""


class Lifecycle(StrEnum):
    """States of every process."""

    STARTING = "STARTING"
    READY = "READY"
    DEGRADED = "DEGRADED"
    STOPPING = "STOPPING"


class ProcessStatus(Message, frozen=True, kw_only=True):
    """Lifecycle, CPU use (share of one core since the last status) and deadlines of one process (1 Hz)."""

    state: Lifecycle
    pid: int
    cpu: float
    ticks: int = 0
    overruns: int = 0
    overflowed: int = 0
    detail: str = ""
