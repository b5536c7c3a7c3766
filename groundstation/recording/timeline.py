"""Maps boot-clock stamps to UNIX time, by one mapping for a whole recording."""

from groundstation.bus.messages import ClockOffset
from groundstation.time_units import NS_PER_S

# A stamp farther from its arrival is a sender's defect: it must not stretch the time axis.
_PLAUSIBLE_NS = 10 * NS_PER_S
# A file's times have 64 bits without a sign, tables of them 63.
_LATEST_NS = (1 << 63) - 1


class Timeline:
    """Maps stamps of this host's clock, and of others once their offset is known.

    clock: id of this host's boot clock; unix_offset_ns: UNIX minus boot time, read once. So later steps of the system's
    clock do not affect a recording.
    """

    def __init__(self, clock: str, unix_offset_ns: int) -> None:
        self.clock = clock
        self.unix_offset_ns = unix_offset_ns
        self._offsets = {clock: 0}

    def learn(self, offset: ClockOffset) -> None:
        """Take the measured offset of another host's clock, if it is to ours."""
        if offset.header.clock == self.clock and offset.of != self.clock:
            self._offsets[offset.of] = offset.offset_ns

    def times(self, stamp_ns: int, clock: str, arrival_ns: int) -> tuple[int, int]:
        """Return (log time, publish time) in UNIX ns.

        Publish time is the mapped stamp, as far as 63 bits hold it. Log time is the same, unless the stamp is
        implausible or its clock unknown: then the time of arrival.
        """
        arrival = arrival_ns + self.unix_offset_ns
        offset = self._offsets.get(clock)
        if offset is None:
            return arrival, arrival
        published = min(max(0, stamp_ns + offset + self.unix_offset_ns), _LATEST_NS)
        if abs(published - arrival) > _PLAUSIBLE_NS:
            return arrival, published
        return published, published
