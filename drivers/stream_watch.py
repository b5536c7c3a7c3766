"""State of a stream by arrival times, as a pure state machine; the driver turns changes into events."""

from dataclasses import dataclass
from enum import StrEnum

from groundstation.time_units import NS_PER_S


class StreamState(StrEnum):
    """WAITING for the first piece, FLOWING, SILENT for too long, or REFUSED: pieces are unusable."""

    WAITING = "WAITING"
    FLOWING = "FLOWING"
    SILENT = "SILENT"
    REFUSED = "REFUSED"


@dataclass(slots=True)
class StreamWatch:
    """Follows one stream; `since_ns` is the time of the last piece, or of the start."""

    start_within_s: float
    stall_after_s: float
    since_ns: int
    state: StreamState = StreamState.WAITING
    reason: str = ""

    def usable(self, now_ns: int) -> bool:
        """Take in a usable piece; returns whether the state changed."""
        self.since_ns = now_ns
        return self._go(StreamState.FLOWING, "")

    def refused(self, reason: str, now_ns: int) -> bool:
        """Take in an unusable piece, and why; returns whether state or reason changed."""
        self.since_ns = now_ns
        return self._go(StreamState.REFUSED, reason)

    def look(self, now_ns: int) -> bool:
        """Let time pass; returns whether the stream has just fallen silent."""
        if self.silent_s(now_ns) < self.patience_s:
            return False
        return self._go(StreamState.SILENT, "")

    @property
    def patience_s(self) -> float:
        """Return the permitted silence [s]: longer for the first piece only."""
        return self.start_within_s if self.state is StreamState.WAITING else self.stall_after_s

    def silent_s(self, now_ns: int) -> float:
        """Return for how long nothing has come [s]."""
        return (now_ns - self.since_ns) / NS_PER_S

    def _go(self, state: StreamState, reason: str) -> bool:
        changed = (state, reason) != (self.state, self.reason)
        self.state, self.reason = state, reason
        return changed
