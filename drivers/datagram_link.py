"""The datagrams of one vehicle: a thread passes them on, all are recorded, and losses are silent, as in radio."""

import logging
import select
import socket
import threading
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress

from drivers.base import LinkHealth
from drivers.datagrams import DatagramLog
from drivers.vehicle_socket import open_udp
from groundstation.adapters import Address
from groundstation.bus import clock
from groundstation.errors import DriverError
from groundstation.time_units import NS_PER_MS

# Takes a datagram with its arrival [ns] and returns whether it was a report of the vehicle. A ValueError refuses it;
# the error's `reason`, if it has one, is the name under which it is counted.
Take = Callable[[int, bytes], bool]

_WAIT_S = 0.1
_LARGEST = 4096
_SILENT_NS = 300 * NS_PER_MS
_SEEKS_NS = 2000 * NS_PER_MS
_log = logging.getLogger(__name__)


class DatagramLink:
    """Ports of this computer, each with a taker of its datagrams; the first one sends to the vehicle.

    All are connected to the vehicle's one port: only that is received, and several vehicles may share a port of ours.
    One that has received nothing 2 s after the first answer takes the datagrams of any port of the vehicle's address,
    and is connected to the port of the first. Takers are called from the reader thread, which starts at once. Raises
    DriverError for a port or an address that is not available.
    """

    def __init__(
        self, log: DatagramLog, peer: Address, takers: Mapping[Address, Take], interface: str = ""
    ) -> None:  # fmt: skip
        self._log = log
        self._takers: dict[socket.socket, Take] = {}
        self._peer, self._interface = peer, interface
        self._unheard: dict[Take, Address] = {take: local for local, take in takers.items()}
        self._seeking: set[socket.socket] = set()
        self._answered_ns = 0
        try:
            for local, take in takers.items():
                self._open(take, local, peer)
        except BaseException:
            self._close_sockets()
            raise
        self._voice = next(iter(self._takers))
        self._heard_ns, self._rate_hz = 0, 0.0
        self._rejected: Counter[str] = Counter()
        self._closing = threading.Event()
        self._reader = threading.Thread(target=self._read, name="vehicle-link", daemon=True)
        self._reader.start()

    def _read(self) -> None:
        while not self._closing.is_set():
            readable, _, _ = select.select(list(self._takers), [], [], _WAIT_S)
            for udp in readable:
                with suppress(OSError):  # nobody listens there yet
                    data, sender = udp.recvfrom(_LARGEST)
                    self._receive(clock.now_ns(), udp, data, sender)
            if self._unheard and self._answered_ns and clock.now_ns() - self._answered_ns > _SEEKS_NS:
                self._seek()

    def _open(self, take: Take, local: Address, peer: Address | None) -> socket.socket:
        udp = open_udp(local, self._interface, peer, shares=peer is None)
        udp.setblocking(False)
        self._takers[udp] = take
        return udp

    def _receive(self, now_ns: int, udp: socket.socket, data: bytes, sender: Address) -> None:
        take = self._takers[udp]
        if udp in self._seeking:
            if sender[0] != self._peer[0]:
                self._rejected["stranger"] += 1
                return
            self._replace(udp, sender)
        self._unheard.pop(take, None)
        if udp is self._voice:
            self._answered_ns = self._answered_ns or now_ns
        self._hand_on(now_ns, data, take)

    def _seek(self) -> None:
        """Let ports that heard nothing hear each port of the vehicle's address."""
        for udp, take in list(self._takers.items()):
            if take in self._unheard and udp not in self._seeking and udp is not self._voice:
                self._replace(udp, None)

    def _replace(self, udp: socket.socket, peer: Address | None) -> None:
        take = self._takers[udp]
        with suppress(DriverError):  # a port that another program has taken stays as it is
            opened = self._open(take, udp.getsockname(), peer)
            del self._takers[udp]
            self._seeking.discard(udp)
            udp.close()
            if peer is None:
                self._seeking.add(opened)

    def _hand_on(self, now_ns: int, data: bytes, take: Take) -> None:
        self._log.received(now_ns, data)
        try:
            is_report = take(now_ns, data)
        except ValueError as error:
            self._rejected[getattr(error, "reason", "unreadable")] += 1
        except Exception:  # noqa: BLE001 - the reader must outlive whatever a vehicle sends: count, log, go on
            self._rejected["internal"] += 1
            _log.exception("a datagram could not be used")
        else:
            if is_report:
                self._count(now_ns)

    def _count(self, now_ns: int) -> None:
        if self._heard_ns:
            self._rate_hz += 0.1 * (1e9 / max(1, now_ns - self._heard_ns) - self._rate_hz)
        self._heard_ns = now_ns

    def send(self, now_ns: int, data: bytes) -> None:
        """Send a datagram; a full buffer or an absent vehicle loses it."""
        with suppress(OSError):
            self._voice.send(data)
            self._log.sent(now_ns, data)

    def health(self, now_ns: int) -> LinkHealth:
        """Return the rate of the vehicle's reports, 0 after 0.3 s without any, and the refusals."""
        silent = now_ns - self._heard_ns > _SILENT_NS
        return LinkHealth(None, 0.0 if silent else self._rate_hz, dict(self._rejected))

    def flush(self) -> None:
        """Publish the raw datagrams that wait."""
        self._log.flush()

    def close(self) -> None:
        """Stop the reader, close the ports, and publish the raw datagrams that wait."""
        self._closing.set()
        self._reader.join(timeout=1.0)
        self._close_sockets()
        self._log.flush()

    def _close_sockets(self) -> None:
        for udp in self._takers:
            udp.close()


class DatagramVehicle:
    """Base of a `drivers.base.Vehicle` behind one link, which it creates as `_link` once it can take datagrams."""

    _link: DatagramLink

    def health(self, now_ns: int) -> LinkHealth:
        """Return the state of the link."""
        return self._link.health(now_ns)

    def flush(self) -> None:
        """Publish the raw datagrams that wait."""
        self._link.flush()

    def close(self) -> None:
        """Stop the reader and close the link."""
        self._link.close()
