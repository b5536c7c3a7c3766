"""Decides which orders count: recent ones of this run, and starts only from the holder of a live lease.

A start given before the last stop never counts: its repetitions may arrive after that stop.
"""

from dataclasses import dataclass

from groundstation.bus.messages import Command, Lease, Verb
from groundstation.bus.stop_mark import StopMark, why_another_runs, why_too_old
from groundstation.time_units import NS_PER_S

# Orders that begin or continue a motion; all others stop, and anyone may stop.
STARTING_VERBS = frozenset({Verb.TAKEOFF, Verb.TRACK, Verb.RESUME})
# A lease may not claim a longer life than this from its receipt.
_LONGEST_NS = 5 * NS_PER_S
# Both ends read the same clock; only the order of readings may differ.
_FUTURE_NS = NS_PER_S


@dataclass(slots=True)
class LeaseBook:
    """Remembers the live lease; another holder gets it only after that expired or was given back.

    run: the run whose orders count, "" for any. source: sender of the lease, as verified by the bus.
    """

    clock: str
    run: str = ""
    holder: str = ""
    source: str = ""
    expires_ns: int = 0
    stamp_ns: int = -1
    last_stop: StopMark | None = None

    def accept(self, now_ns: int, lease: Lease) -> str:
        """Take a lease message; returns "" or why it is ignored (other_clock, future, held, old)."""
        if lease.header.clock != self.clock:
            return "other_clock"
        if lease.header.stamp_ns > now_ns + _FUTURE_NS:
            return "future"  # it would make every genuine lease look old
        if lease.header.stamp_ns <= self.stamp_ns:
            return "old"
        if now_ns < self.expires_ns and (lease.holder, lease.header.source) != (self.holder, self.source):
            return "held"
        self.holder, self.source, self.stamp_ns = lease.holder, lease.header.source, lease.header.stamp_ns
        self.expires_ns = min(lease.expires_ns, now_ns + _LONGEST_NS)
        return ""

    def refusal(self, now_ns: int, command: Command) -> str:
        """Return "" if the command is permitted to its issuer now, else why not; anybody of the run may stop."""
        if why := why_another_runs(command, self.run):
            return why
        if command.verb not in STARTING_VERBS:
            return why_too_old(command, now_ns, self.clock)
        if command.header.clock != self.clock:
            return "sent from a host whose clock is not known here"
        if now_ns >= command.expires_ns:
            return "expired"
        if now_ns >= self.expires_ns:
            return "no live operator lease"
        if (command.issuer, command.header.source) != (self.holder, self.source):
            return f"the operator lease is held by {self.holder}"
        stop = self.last_stop
        return stop.words if stop is not None and stop.overtakes(command.header.stamp_ns) else ""

    def hear_stop(self, now_ns: int, stop: Command) -> None:
        """Remember a valid stop."""
        mark = StopMark.of(stop, now_ns, self.clock)
        if self.last_stop is None or self.last_stop.given_ns < mark.given_ns:
            self.last_stop = mark
