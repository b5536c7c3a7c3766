"""Decides which setpoint may move a vehicle: the newest in sequence, of the authorised epoch, not expired.

Pure; times are monotonic nanoseconds from the caller.
"""

from dataclasses import dataclass

from groundstation.bus.messages import VelocitySetpoint
from groundstation.time_units import NS_PER_MS

# A thousand lives of the tracker, each with up to a thousand epochs.
_LONGEST_LEAP = 1_000_000


@dataclass(slots=True)
class SetpointGate:
    """Remembers the newest setpoint, and when the authorised epoch last sent. Only the first sender is accepted.

    max_lifetime_ns caps the lifetime that a setpoint claims. epoch: the authorised one (None: the first that comes is
    authorised). last_heard_ns: receipt of the last live setpoint of that epoch; any_heard_ns: of any.
    """

    max_lifetime_ns: int
    clock: str
    epoch: int | None = None
    last_heard_ns: int | None = None
    any_heard_ns: int | None = None
    newest: VelocitySetpoint | None = None
    expires_ns: int = 0

    def accept(self, now_ns: int, setpoint: VelocitySetpoint) -> str:
        """Take a setpoint; returns "" or why it is ignored.

        Reasons: other_source, old_epoch, epoch_leap, old_sequence, expired.
        """
        if self.newest is not None:
            # Later lives of the tracker have its name: a sender with another name is not the tracker, and its numbers
            # mean nothing.
            if setpoint.header.source != self.newest.header.source:
                return "other_source"
            if setpoint.epoch < self.newest.epoch:
                return "old_epoch"
            if setpoint.epoch > self.newest.epoch + _LONGEST_LEAP:
                return "epoch_leap"  # it would make every genuine setpoint look old
            if setpoint.epoch == self.newest.epoch and setpoint.header.seq <= self.newest.header.seq:
                return "old_sequence"
        expires_ns = self._expiry(now_ns, setpoint)
        if expires_ns <= now_ns:
            return "expired"
        self.newest, self.expires_ns, self.any_heard_ns = setpoint, expires_ns, now_ns
        if self.epoch is None:
            self.epoch = setpoint.epoch
        if self.epoch == setpoint.epoch:
            self.last_heard_ns = now_ns
        return ""

    def _expiry(self, now_ns: int, setpoint: VelocitySetpoint) -> int:
        # The earlier of receipt + lifetime and, where the clocks are the same, stamp + lifetime.
        lifetime_ns = min(setpoint.lifetime_ms * NS_PER_MS, self.max_lifetime_ns)
        if setpoint.header.clock != self.clock:
            return now_ns + lifetime_ns
        return min(now_ns, setpoint.header.stamp_ns) + lifetime_ns

    def live(self, now_ns: int) -> VelocitySetpoint | None:
        """Return the newest setpoint of any epoch unless it expired."""
        return self.newest if self.newest is not None and now_ns < self.expires_ns else None

    def obeyed(self, now_ns: int) -> VelocitySetpoint | None:
        """Return the setpoint that may move the vehicle now: authorised epoch, converged, live."""
        setpoint = self.live(now_ns)
        return setpoint if setpoint is not None and setpoint.converged and setpoint.epoch == self.epoch else None

    @property
    def foreign(self) -> bool:
        """Return whether setpoints of a newer epoch than the authorised one arrive."""
        return self.newest is not None and self.epoch is not None and self.newest.epoch != self.epoch

    def adopt(self, now_ns: int) -> bool:
        """Authorise the newest epoch if its setpoint is live and converged; returns whether it did."""
        setpoint = self.live(now_ns)
        if setpoint is None or not setpoint.converged:
            return False
        self.epoch, self.last_heard_ns = setpoint.epoch, now_ns
        return True

    def forget_epoch(self) -> None:
        """Withdraw the authorisation, for a new take-off; sequence and epoch order are kept."""
        self.epoch = self.last_heard_ns = None
