"""An emulated motion capture system: a NatNet server that streams the poses of all bodies.

WIRE (docs/reference/natnet.md 2): frames go to a multicast group, or to each client that asked to connect. Published
clients wait for the latter at two places: most at the port that asked, as long as they keep sending, and those whose
request has no content (libmotioncapture) at the data port of their host, without sending again.
"""

import socket
import struct
from contextlib import suppress

from drivers.motion_capture.wire import natnet
from groundstation.bus import clock
from groundstation.time_units import NS_PER_S
from sim_bridge.devices.captured_bodies import FRAME_TICKS, TICK_S, CapturedBodies
from sim_bridge.listening import open_udp

Address = tuple[str, int]
VERSION = (4, 1)
_TICKS_PER_S = 10_000_000
_DATAGRAMS_PER_TICK = 64
_FORGOTTEN_TICKS = 2000  # a client that is silent for 10 s is gone
_REFUSED_TICKS = 400  # one that has opened no data port 2 s after it asked is gone
MULTICAST_GROUP = "239.255.42.99"
# The delay before the system sends a frame [s]; each frame states it.
_PROCESSING_S = 0.005


class NatnetEmulator:
    """Sockets of one system; `sim_bridge.world.emulation.Emulator`.

    place: address and port for requests; the data port is the next one. group: the multicast address for its frames,
    which stay on this host; "": they go to each client alone.
    """

    def __init__(self, name: str, place: Address, seen: CapturedBodies, group: str = "") -> None:
        self.silent = self.deaf = False
        self._seen = seen
        self._ids = {body: number for number, body in enumerate(seen.names, start=1)}
        self._socket = open_udp(f"emulated {name}", *place)
        self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(place[0]))
        self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        self._server = natnet.Server("Skein", VERSION, _TICKS_PER_S, place[1] + 1, group)
        self._heard: dict[Address, int] = {}
        self._waiting_at: dict[str, _DataPort] = {}
        self._ticks = self._frames = 0
        self._waiting: list[tuple[int, bytes]] = []

    def fileno(self) -> int:
        """Return the descriptor of its port."""
        return self._socket.fileno()

    def receive(self) -> None:
        """Answer all waiting requests."""
        for _ in range(_DATAGRAMS_PER_TICK):
            try:
                datagram, sender = self._socket.recvfrom(2048)
                kind, payload = natnet.message_of(datagram)
            except OSError:
                return
            except natnet.WireError:
                continue
            if not self.deaf:
                self._hear(kind, payload, sender)

    def send(self) -> None:
        """End a tick: take a frame when one is due, and send those whose delay is over."""
        self._ticks += 1
        now_s = self._ticks * TICK_S
        if self._ticks % FRAME_TICKS == 0:
            self._frames += 1
            late = round((_PROCESSING_S + self._seen.system.delay_ms / 1000) / TICK_S)
            self._waiting.append((self._ticks + late, natnet.encode_frame(self._frame(now_s), VERSION)))
        self._heard = {one: heard for one, heard in self._heard.items() if self._ticks - heard < _FORGOTTEN_TICKS}
        while self._waiting and self._waiting[0][0] <= self._ticks:
            _, datagram = self._waiting.pop(0)
            if not self.silent and not self._seen.is_silent(now_s):
                self._stream(datagram)

    def close(self) -> None:
        """Close the ports."""
        self._socket.close()
        for port in self._waiting_at.values():
            port.close()

    def _hear(self, kind: int, payload: bytes, sender: Address) -> None:
        """Answer a request as Motive does (docs/reference/natnet.md 1)."""
        if kind in (natnet.CONNECT, natnet.DISCOVERY):
            self._answer(natnet.encode_server(self._server), sender)
        if kind == natnet.CONNECT and payload:
            self._heard[sender] = self._ticks
        elif kind == natnet.CONNECT and not self._server.group:
            self._open_data_port(sender[0])
        elif kind == natnet.DISCONNECT:
            self._heard.pop(sender, None)
        elif kind == natnet.REQUEST_DESCRIPTIONS:
            names = {number: body for body, number in self._ids.items()}
            self._answer(natnet.encode_descriptions(names, VERSION), sender)
        elif kind == natnet.ECHO_REQUEST:
            self._answer(natnet.encode_echo(payload, _now_ticks()), sender)
        elif kind == natnet.REQUEST:
            self._answer(_response(payload), sender)
        if sender in self._heard:
            self._heard[sender] = self._ticks

    def _open_data_port(self, host: str) -> None:
        if host in self._waiting_at:
            self._waiting_at.pop(host).close()
        self._waiting_at[host] = _DataPort((host, self._server.data_port), self._ticks)

    def _stream(self, datagram: bytes) -> None:
        if self._server.group:
            self._answer(datagram, (self._server.group, self._server.data_port))
            return
        for client in self._heard:
            self._answer(datagram, client)
        for host, port in list(self._waiting_at.items()):
            if not port.send(datagram, self._ticks):
                self._waiting_at.pop(host).close()

    def _answer(self, datagram: bytes, client: Address) -> None:
        with suppress(OSError):
            self._socket.sendto(datagram, client)

    def _frame(self, now_s: float) -> natnet.Frame:
        exposed = _now_ticks()
        sent = exposed + round(_PROCESSING_S * _TICKS_PER_S)
        bodies = [natnet.Body(self._ids[b.name], b.place, b.quaternion, b.inside) for b in self._seen.frame(now_s)]
        return natnet.Frame(self._frames, tuple(bodies), exposed, sent)


class _DataPort:
    """Frames for a client that waits at the data port of its host; connected, so that a closed port is noticed."""

    def __init__(self, place: Address, since: int) -> None:
        self._since = since
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.connect(place)

    def send(self, datagram: bytes, ticks: int) -> bool:
        """Send a frame; returns whether the client is still there."""
        try:
            self._socket.send(datagram)
        except ConnectionRefusedError:
            return ticks - self._since < _REFUSED_TICKS
        except OSError:
            pass
        return True

    def close(self) -> None:
        """Close the port."""
        self._socket.close()


def _now_ticks() -> int:
    """Return the system's clock; not the ticks of the simulation, which stand while its host has no time for it."""
    return clock.now_ns() * _TICKS_PER_S // NS_PER_S


def _response(request: bytes) -> bytes:
    """Return the answer to a command, which is a text; commands that change Motive are unknown to the emulator."""
    command = request.partition(b"\0")[0]
    if command == b"FrameRate":
        return natnet.encode(natnet.RESPONSE, struct.pack("<f", 1 / (FRAME_TICKS * TICK_S)))
    if command == b"Bitstream":
        return natnet.encode(natnet.RESPONSE, b"Bitstream,%d.%d\0" % VERSION)
    return natnet.encode(natnet.UNRECOGNIZED)
