"""The link to one client as the drone keeps it: bootstrap, sequence rules, command ack, watchdogs. Pure."""

from enum import Enum, auto

COM_WATCHDOG_NS = 50_000_000
COM_LOST_NS = 2_000_000_000
LAND_AFTER_LOST_NS = 1_000_000_000
_BOOTSTRAP_PATIENCE_NS = 1_000_000_000
# WIRE: an ack that comes and goes within one packet is missed by real clients: hold bit 6 for two.
_ACK_PACKETS = 2

Address = tuple[str, int]


class Link(Enum):
    """How long the client has been silent."""

    ALIVE = auto()
    LATE = auto()
    LOST = auto()


class Session:
    """One client's session; times are of the emulator's clock [ns]."""

    def __init__(self) -> None:
        self.client: Address | None = None
        self.bootstrap = True
        self.navdata_sequence = 0
        self.at_sequence = 0
        self.ack = False
        self._last_at_ns: int | None = None
        self._last_request_ns = 0
        self._fresh = True
        self._ack_packets = 0
        self._ack_cleared = False
        self._configured_ns: int | None = None

    def request(self, client: Address, now_ns: int) -> bool:
        """Take a navdata request; returns whether it opened a new session (True) or was repeated (False)."""
        self._last_request_ns = now_ns
        if client == self.client:
            return False
        self.client = client
        self.bootstrap = True
        self.navdata_sequence = 0
        self._configured_ns = None
        return True

    def hear(self, now_ns: int) -> None:
        """Note an AT datagram, whatever it holds: any traffic feeds the watchdogs."""
        self._last_at_ns = now_ns

    def accept(self, sequence: int) -> bool:
        """Return whether a command is to be obeyed: newer than the last, or 1, or the first after silence."""
        if not self._fresh and sequence != 1 and sequence <= self.at_sequence:
            return False
        self._fresh = False
        self.at_sequence = sequence
        return True

    def link(self, now_ns: int) -> Link:
        """Return how long the client has been silent."""
        silence = self.silence_ns(now_ns)
        if silence > COM_LOST_NS:
            return Link.LOST
        return Link.LATE if silence > COM_WATCHDOG_NS else Link.ALIVE

    def silence_ns(self, now_ns: int) -> int:
        """Return the time since the last AT datagram; for ever if there was none."""
        return COM_LOST_NS * 1000 if self._last_at_ns is None else now_ns - self._last_at_ns

    def forget_silent(self, now_ns: int) -> None:
        """Drop a client that neither commands nor asks for 2 s: it has to ask for navdata again, with any number."""
        if self.silence_ns(now_ns) <= COM_LOST_NS:
            return
        self.at_sequence = 0
        self._fresh = True
        if self.client is None or now_ns - self._last_request_ns <= COM_LOST_NS:
            return
        self.client = None
        self.bootstrap = True
        self.navdata_sequence = 0
        self.ack = False
        self._configured_ns = None

    def raise_ack(self) -> None:
        """Set the command bit."""
        self.ack = True
        self._ack_packets = 0
        self._ack_cleared = False

    def clear_ack(self) -> None:
        """Obey CTRL 5: clear the command bit once it has been seen in two packets."""
        self._ack_cleared = True
        self._settle_ack()

    def configured(self, now_ns: int) -> None:
        """Note that the client has chosen its navdata mode."""
        if self.bootstrap and self._configured_ns is None:
            self._configured_ns = now_ns

    def leave_bootstrap(self, now_ns: int) -> None:
        """End the bootstrap when the mode is chosen and acknowledged; clients that never acknowledge wait 1 s."""
        if self.bootstrap and self._configured_ns is not None:
            self.bootstrap = self.ack and now_ns - self._configured_ns < _BOOTSTRAP_PATIENCE_NS

    def next_packet(self) -> int:
        """Return the sequence number of the navdata packet about to be sent."""
        self.navdata_sequence += 1
        return self.navdata_sequence

    def sent(self) -> None:
        """Note that a packet has gone out."""
        self._ack_packets += self.ack
        self._settle_ack()

    def _settle_ack(self) -> None:
        if self._ack_cleared and self._ack_packets >= _ACK_PACKETS:
            self.ack = self._ack_cleared = False
