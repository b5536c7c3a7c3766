"""One UDP port with any number of vehicles behind it: accepted senders, and the address of each vehicle."""

import logging
import socket
import threading
import zlib
from contextlib import suppress

from drivers import vehicle_socket
from drivers.mavlink.links.datagram_cutter import DatagramCutter
from drivers.mavlink.links.frame_codec import FrameCodec
from drivers.mavlink.links.refusals import DUPLICATE, LinkRefusals
from drivers.mavlink.links.seam import Heard, Sniffer, Transport, ignore_bytes
from drivers.mavlink.other_stations import speaks_as_we
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.frames import MAX_DATAGRAM, Message, ReceivedFrame
from drivers.mavlink.wire.names import AUTOPILOT_COMPONENT
from drivers.mavlink.wire.signature import MAGIC_1
from drivers.mavlink.wire.telemetry import OUR_HEARTBEAT
from drivers.mavlink.wire.verification import Signing, old_sender
from groundstation.adapters import Address, bind_to_adapter, split_zone
from groundstation.bus import clock
from groundstation.errors import DriverError
from groundstation.process.ports import why_refused
from groundstation.time_units import NS_PER_S

_POLL_S = 0.1
_ADDRESS_HELD_NS = 3 * NS_PER_S
_FIRST_OWN_PORT, _OWN_PORTS = 14_300, 200
_GREETED_NS, _MOST_GREETED = NS_PER_S, 250
_log = logging.getLogger(__name__)


def _bind_as_ever(sock: socket.socket, target: str) -> None:
    """Send from the same port each time: until it restarts, PX4 answers the first port that sent to it."""
    try:
        sock.bind(("", _FIRST_OWN_PORT + zlib.crc32(target.encode()) % _OWN_PORTS))
    except OSError:  # another program sends to that vehicle already
        sock.bind(("", 0))


class UdpLink(Transport):
    """Datagrams. `udpout` sends to one address; `udpin` waits for vehicles and keeps the address of each.

    WIRE (docs/reference/mavlink.md 5.6): one socket for many vehicles needs an address per system id: that of its
    autopilot.
    """

    def __init__(self, settings: LinkSettings, signing: Signing | None = None, sniffer: Sniffer = ignore_bytes) -> None:
        way, place, port = settings.target.split(":")
        address, interface = split_zone(place)
        self.rejected = LinkRefusals()
        self._peer = (address, int(port)) if way == "udpout" else None
        self._addresses: dict[int, tuple[tuple[str, int], int]] = {}
        self._codec, self._lock = FrameCodec(settings, signing), threading.Lock()
        self._cutter = DatagramCutter(self._reject)
        self._sniffer, self._signed = sniffer, signing is not None
        self._greeted: dict[tuple[str, int], int] = {}
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        bind_to_adapter(self._socket, interface)
        try:
            if self._peer is None:
                self._socket.bind((address, int(port)))
            else:
                _bind_as_ever(self._socket, settings.target)
        except OSError as error:
            self._socket.close()
            why = why_refused(error, address, int(port), socket.SOCK_DGRAM)
            raise DriverError(f"cannot listen on {settings.target}: {why}") from error
        self._socket.setblocking(False)

    @property
    def called_from(self) -> tuple[Address, ...]:
        """Return the last addresses of the vehicles, if the link waits for them."""
        return () if self._peer else tuple(dict.fromkeys(address for address, _ in self._addresses.copy().values()))

    @property
    def newest_stamp(self) -> int:
        """Return the newest time of signing, received or sent; 0 without a key."""
        return self._codec.newest_stamp

    def receive_raw(self) -> list[tuple[Heard, bytes]]:
        """Wait up to 0.1 s for a datagram; return the frames that end in it, each with its bytes."""
        try:
            if not vehicle_socket.waits(self._socket, _POLL_S):
                return []
            data, source = self._socket.recvfrom(MAX_DATAGRAM)
        except (OSError, ValueError) as error:  # ValueError: the socket was closed meanwhile
            # An ICMP "port unreachable" answers a datagram to a vehicle that is not there yet.
            self._reject("receive_failed", str(error))
            return []
        return self._judge(clock.now_ns(), data, source)

    def _judge(self, now_ns: int, data: bytes, source: tuple[str, int]) -> list[tuple[Heard, bytes]]:
        heard: list[tuple[Heard, bytes]] = []
        if self._peer is not None and source[0] != self._peer[0]:
            self._reject("foreign_address", f"{source[0]}:{source[1]}")
            return heard
        for raw in self._cutter.take(now_ns, data, source):
            if raw[0] == MAGIC_1:
                self._hear_old(now_ns, raw, source)
                continue
            frame = self._decode(now_ns, raw, source)
            if frame is None or speaks_as_we(frame, self._codec.own, self.rejected):
                continue
            if self._is_at(now_ns, frame, source):
                self._sniffer(frame.system, now_ns, raw, True)
                heard.append((Heard(now_ns, frame), raw))
        return heard

    def _hear_old(self, now_ns: int, raw: bytes, source: tuple[str, int]) -> None:
        """Record a frame of MAVLink 1, unless the link is signed or its system is at another address, and greet."""
        self._reject("mavlink_1", f"{source[0]}:{source[1]}")
        self._greet(now_ns, source)
        if self._signed:
            return
        with suppress(WireError):
            system = old_sender(raw)
            if self._addresses.get(system, (source,))[0] == source:
                self._sniffer(system, now_ns, raw, True)

    def _greet(self, now_ns: int, source: tuple[str, int]) -> None:
        """Send a MAVLink 1 vehicle a frame of version 2, or our time to a vehicle whose signing time is old.

        The former then uses version 2; the time of the latter stood still while it was off. WIRE
        (docs/reference/mavlink.md 5.10): PX4 with MAV_PROTO_VER 0. No address is bound by it.
        """
        if now_ns - self._greeted.get(source, -_GREETED_NS) < _GREETED_NS or len(self._greeted) >= _MOST_GREETED:
            return
        self._greeted[source] = now_ns
        with self._lock:
            greeting = self._codec.encode(OUR_HEARTBEAT)
        with suppress(OSError):
            self._socket.sendto(greeting, source)

    def _decode(self, now_ns: int, raw: bytes, source: tuple[str, int]) -> ReceivedFrame | None:
        try:
            return self._codec.decode(raw)
        except WireError as error:
            self._reject(error.reason, str(error))
            if error.reason == "replayed" and self._peer is None:
                self._greet(now_ns, source)
            return None

    def _is_at(self, now_ns: int, frame: ReceivedFrame, source: tuple[str, int]) -> bool:
        system, known = frame.system, self._addresses.get(frame.system)
        if frame.component != AUTOPILOT_COMPONENT:
            # A camera or computer on board may call from elsewhere: the autopilot is not there.
            if known is not None and known[0] != source:
                self._reject("other_component", f"{system}.{frame.component} at {source[0]}:{source[1]}")
                return False
            return True
        if known is not None and known[0] != source and now_ns - known[1] < _ADDRESS_HELD_NS:
            self.rejected.note(DUPLICATE, system)
            _log.debug("system %d at %s:%d and %s", system, *source, known[0])
            return False
        self._addresses[system] = (source, now_ns)
        return True

    def _reject(self, reason: str, detail: str) -> None:
        self.rejected[reason] += 1
        _log.debug("%s: %s", reason, detail)

    def send(self, system: int, message: Message) -> None:
        """Send one message in one datagram."""
        if self._address_of(system) is None:
            return
        with self._lock:
            self.send_raw(system, self._codec.encode(message))

    def _address_of(self, system: int) -> tuple[str, int] | None:
        known = self._addresses.get(system)
        return known[0] if known is not None else self._peer

    def send_raw(self, system: int, data: bytes) -> None:
        """Send whole frames in one datagram to the vehicle's last address."""
        address = self._address_of(system)
        if address is None:
            return
        try:
            self._socket.sendto(data, address)
        except OSError as error:
            self._reject("send_failed", str(error))
        self._sniffer(system, clock.now_ns(), data, False)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
