"""The mark of a stop: it voids starts that were given before it and arrive, or are repeated, after it."""

from dataclasses import dataclass

from groundstation.bus.messages import STOP_LIVES_NS, Command
from groundstation.time_units import NS_PER_S


def why_another_runs(command: Command, run: str) -> str:
    """Return why a command does not belong to this run, or ""; run "": those of all runs count."""
    if not run or command.run == run:
        return ""
    return f"given for another run ({command.run})" if command.run else "given for no run"


def why_too_old(stop: Command, now_ns: int, clock: str) -> str:
    """Return why a stop is too old to count, or ""; the age of one from another clock than ours is unknown."""
    age_ns = now_ns - stop.header.stamp_ns
    if stop.header.clock == clock and age_ns > STOP_LIVES_NS:
        return f"given {age_ns / NS_PER_S:.0f} s ago"
    return ""


@dataclass(frozen=True, slots=True)
class StopMark:
    """Time of a stop [ns; boot clock], and why an earlier start is not carried out."""

    given_ns: int
    words: str

    @classmethod
    def of(cls, stop: Command, now_ns: int, clock: str) -> "StopMark":
        """Return the mark of a stop that arrived now; one from another clock than ours counts from its arrival."""
        given_ns = min(now_ns, stop.header.stamp_ns) if stop.header.clock == clock else now_ns
        return cls(given_ns, f"{stop.verb} by {stop.issuer} came after it")

    def overtakes(self, start_ns: int) -> bool:
        """Return whether a start was given before it [ns; boot clock]."""
        return start_ns < self.given_ns
