"""Who may give starting orders: the holder of an operator lease that has not run out."""

from dataclasses import dataclass

from groundstation.bus.messages import Command, Lease, Verb

# Orders that begin or go on with a motion; all others stop, and anyone may stop.
STARTING_VERBS = frozenset({Verb.TAKEOFF, Verb.TRACK, Verb.RESUME})
# A lease may not claim to live longer than this after it was heard.
_LONGEST_NS = 5_000_000_000
# Both ends read the same clock; only the order of reading may differ.
_FUTURE_NS = 1_000_000_000


@dataclass(slots=True)
class LeaseBook:
    """Remembers the live lease; another holder gets it only after the former ran out or was given back."""

    clock: str
    holder: str = ""
    expires_ns: int = 0
    stamp_ns: int = -1

    def accept(self, now_ns: int, lease: Lease) -> str:
        """Take a lease message; returns "" or why it is ignored (other_clock, future, held, old)."""
        if lease.header.clock != self.clock:
            return "other_clock"
        if lease.header.stamp_ns > now_ns + _FUTURE_NS:
            return "future"  # it would make every true lease look old
        if lease.header.stamp_ns <= self.stamp_ns:
            return "old"
        if now_ns < self.expires_ns and lease.holder != self.holder:
            return "held"
        self.holder, self.stamp_ns = lease.holder, lease.header.stamp_ns
        self.expires_ns = min(lease.expires_ns, now_ns + _LONGEST_NS)
        return ""

    def refusal(self, now_ns: int, command: Command) -> str:
        """Return "" if the command is permitted to its issuer now, else why not; stops always are."""
        if command.verb not in STARTING_VERBS:
            return ""
        if command.header.clock != self.clock:
            return "sent from a host whose clock is not known here"
        if now_ns >= command.expires_ns:
            return "expired"
        if now_ns >= self.expires_ns:
            return "no live operator lease"
        if command.issuer != self.holder:
            return f"the operator lease is held by {self.holder}"
        return ""
