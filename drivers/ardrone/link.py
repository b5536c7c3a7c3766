"""The two UDP links to one AR.Drone: accepted senders, order of packets, and our command numbers."""

import logging
import socket
import threading
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from drivers import vehicle_socket
from drivers.ardrone.settings import ArDroneDriverSettings
from drivers.ardrone.wire import at, navdata
from drivers.ardrone.wire.at import AtCommand
from drivers.ardrone.wire.errors import WireError
from drivers.ardrone.wire.navdata import Navdata
from drivers.arrivals import Arrivals
from drivers.datagrams import DatagramLog
from groundstation.bus import clock
from groundstation.errors import DriverError
from groundstation.time_units import NS_PER_MS

# After this silence a lower sequence number is a new session of the drone, before it a replay.
_RESTART_NS = 300 * NS_PER_MS
_POLL_S = 0.1
_RESET = at.encode(at.comwdg(), 1)
_log = logging.getLogger(__name__)


class SequenceFilter:
    """Accepts rising navdata sequence numbers; counts the missed ones.

    WIRE: the drone restarts at 1 for a new session, which always begins with a pause; a lower number amid the stream is
    a replay or a late duplicate.
    """

    def __init__(self) -> None:
        self._last = -1
        self._accepted_ns = 0
        self.arrivals = Arrivals()

    def accept(self, now_ns: int, sequence: int) -> bool:
        """Return whether a packet with this number is new enough to use."""
        restarted = self._last < 0 or now_ns - self._accepted_ns > _RESTART_NS
        if sequence <= self._last and not restarted:
            return False
        step = 1 if restarted else sequence - self._last
        self._last, self._accepted_ns = sequence, now_ns
        self.arrivals.add(now_ns, step)
        return True


class Arrival(NamedTuple):
    """A datagram as it arrived, unread."""

    stamp_ns: int
    datagram: bytes
    source: tuple[str, int]


class ArDroneLink:
    """Sockets on free ports, or those that the settings name, so that many drones fit on one host.

    sent: number of our last command. No received data raises; the constructor raises DriverError for an unavailable
    port or address.
    """

    def __init__(self, settings: ArDroneDriverSettings, log: DatagramLog) -> None:
        self._settings = settings
        self._log = log
        self._lock = threading.Lock()
        self._navdata_socket = _open(settings, settings.local_navdata_port)
        try:
            self._at_socket = _open(settings, settings.local_at_port)
        except DriverError:
            self._navdata_socket.close()
            raise
        self.sent = 1
        self._filter = SequenceFilter()
        self.rejected: Counter[str] = Counter()

    def receive(self) -> Arrival | None:
        """Wait up to 0.1 s for a datagram; returns None if none came."""
        try:
            if vehicle_socket.waits(self._navdata_socket, _POLL_S):
                datagram, source = self._navdata_socket.recvfrom(navdata.MAX_SIZE + 1)
                now_ns = clock.now_ns()
                self._log.received(now_ns, datagram)
                return Arrival(now_ns, datagram, source)
        except (OSError, ValueError) as error:  # ValueError: it was closed meanwhile
            self._reject("receive_failed", str(error))
        return None

    def packet_of(self, arrival: Arrival) -> Navdata | None:
        """Return the packet in a datagram, or None if it is not usable; call it in the order of arrival."""
        try:
            return self._judge(*arrival)
        except WireError as error:
            self._reject(error.reason, str(error))
            return None

    def _judge(self, now_ns: int, datagram: bytes, source: tuple[str, int]) -> Navdata:
        if source != (self._settings.address, self._settings.navdata_port):
            raise WireError("foreign_address", f"{source[0]}:{source[1]}")
        packet = navdata.decode(datagram, self._settings.strict_checksum)
        with self._lock:
            if not self._filter.accept(now_ns, packet.sequence):
                raise WireError("replayed", str(packet.sequence))
        return packet

    def _reject(self, reason: str, detail: str) -> None:
        self.rejected[reason] += 1
        _log.debug("%s: %s: %s", self._settings.name, reason, detail)

    def request_navdata(self) -> None:
        """Request that the drone streams to our port."""
        self._send_to(self._navdata_socket, navdata.REQUEST, self._settings.navdata_port)

    def send(self, commands: Sequence[AtCommand], insist: bool) -> None:
        """Send commands in one datagram, numbered on from the last; insist: whatever numbers the drone has heard.

        WIRE (docs/reference/ardrone.md 2.2): number 1 is always accepted, and any higher one after it. It goes to a
        COMWDG in front of the others, whose numbers so rise on: by them the drone tells which of ours it obeyed, and a
        late duplicate of an earlier datagram is refused.
        """
        datagram = at.encode_datagram(commands, self.sent + 1, _RESET if insist else b"")
        self.sent += len(commands)
        self._send_to(self._at_socket, datagram, self._settings.at_port)

    def _send_to(self, channel: socket.socket, datagram: bytes, port: int) -> None:
        try:
            channel.sendto(datagram, (self._settings.address, port))
        except OSError as error:
            self._reject("send_failed", str(error))
        self._log.sent(clock.now_ns(), datagram)

    def rates(self, now_ns: int) -> tuple[float, float | None]:
        """Return the navdata rate [Hz] and the share of its datagrams that arrived."""
        with self._lock:
            return self._filter.arrivals.rates(now_ns)

    def close(self) -> None:
        """Close both sockets."""
        self._navdata_socket.close()
        self._at_socket.close()


def _open(settings: ArDroneDriverSettings, port: int) -> socket.socket:
    channel = vehicle_socket.open_udp((settings.local_address, port), settings.interface)
    channel.setblocking(False)
    return channel
