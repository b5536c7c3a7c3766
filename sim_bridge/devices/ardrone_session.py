"""The command link of an emulated AR.Drone: sequence rules, command ack, watchdogs. Pure."""

from enum import Enum, auto

from groundstation.time_units import NS_PER_MS, NS_PER_S

COM_WATCHDOG_NS = 50 * NS_PER_MS
COM_LOST_NS = 2 * NS_PER_S
LAND_AFTER_LOST_NS = 500 * NS_PER_MS
# WIRE: an ack that comes and goes within one packet is missed by real clients: hold bit 6 for two.
ACK_PACKETS = 2


class CommandLink(Enum):
    """State of the command link, by the silence of its client."""

    ALIVE = auto()
    LATE = auto()
    LOST = auto()


class CommandSession:
    """The session of the present sender of commands; times are of the emulator's clock [ns]."""

    def __init__(self) -> None:
        self.at_sequence = 0
        self.ack = False
        self.mean_gap_ms = 0
        self._last_at_ns: int | None = None
        self._fresh = True
        self.answering_config = False
        self._ack_packets = 0
        self._ack_cleared = False

    def take(self, now_ns: int) -> None:
        """Note an AT datagram of any content: any traffic feeds the watchdogs."""
        if self._last_at_ns is not None:
            self.mean_gap_ms = (now_ns - self._last_at_ns) // 1_000_000
        self._last_at_ns = now_ns

    def accept(self, sequence: int) -> bool:
        """Return whether a command is to be obeyed: newer than the last, or 1, or the first after silence."""
        if not self._fresh and sequence != 1 and sequence <= self.at_sequence:
            return False
        self._fresh = False
        self.at_sequence = sequence
        return True

    def link(self, now_ns: int) -> CommandLink:
        """Return the state of the link."""
        silence = self.silence_ns(now_ns)
        if silence > COM_LOST_NS:
            return CommandLink.LOST
        return CommandLink.LATE if silence > COM_WATCHDOG_NS else CommandLink.ALIVE

    def silence_ns(self, now_ns: int) -> int:
        """Return the time since the last AT datagram [ns]; endless if there was none."""
        return COM_LOST_NS * 1000 if self._last_at_ns is None else now_ns - self._last_at_ns

    def forget_silent(self, now_ns: int) -> None:
        """After 2 s without commands, take any sequence number for the next."""
        if self.silence_ns(now_ns) > COM_LOST_NS:
            self.at_sequence = 0
            self._fresh = True

    def raise_ack(self, answering_config: bool) -> None:
        """Set the command bit, for a CONFIG or for a dump."""
        self.ack, self.answering_config = True, answering_config
        self._ack_packets = 0
        self._ack_cleared = False

    def clear_ack(self) -> None:
        """Obey CTRL 5: clear the command bit once two packets have carried it."""
        self._ack_cleared = True
        self._settle_ack()

    def drop_ack(self) -> None:
        """Clear the command bit at once: there is no client left."""
        self.ack = self._ack_cleared = False

    def sent(self) -> None:
        """Note that a packet was sent to all listeners."""
        self._ack_packets += self.ack
        self._settle_ack()

    def _settle_ack(self) -> None:
        if self._ack_cleared and self._ack_packets >= ACK_PACKETS:
            self.ack = self._ack_cleared = False
