"""An emulated motion capture system: a NatNet server that streams the poses of all bodies.

WIRE (docs/reference/natnet.md 2): a client that asked to connect is sent frames as long as it keeps sending.
"""

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
# The delay before the system sends a frame [s]; each frame states it.
_PROCESSING_S = 0.005


class NatnetEmulator:
    """Sockets of one system; `sim_bridge.world.emulation.Emulator`."""

    def __init__(self, name: str, place: Address, seen: CapturedBodies) -> None:
        self.silent = self.deaf = False
        self._seen = seen
        self._ids = {body: number for number, body in enumerate(seen.names, start=1)}
        self._socket = open_udp(f"emulated {name}", *place)
        self._server = natnet.Server("Skein", VERSION, _TICKS_PER_S, place[1], "")
        self._heard: dict[Address, int] = {}
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
                kind, _ = natnet.message_of(datagram)
            except OSError:
                return
            except natnet.WireError:
                continue
            if self.deaf:
                continue
            if kind == natnet.CONNECT:
                self._heard[sender] = self._ticks
                self._answer(natnet.encode_server(self._server), sender)
            elif kind == natnet.REQUEST_DESCRIPTIONS:
                names = {number: body for body, number in self._ids.items()}
                self._answer(natnet.encode_descriptions(names, VERSION), sender)
            elif sender in self._heard:
                self._heard[sender] = self._ticks

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
                for client in self._heard:
                    self._answer(datagram, client)

    def close(self) -> None:
        """Close the port."""
        self._socket.close()

    def _answer(self, datagram: bytes, client: Address) -> None:
        with suppress(OSError):
            self._socket.sendto(datagram, client)

    def _frame(self, now_s: float) -> natnet.Frame:
        # Not the ticks of the simulation, which stand while its host has no time for it.
        exposed = clock.now_ns() * _TICKS_PER_S // NS_PER_S
        sent = exposed + round(_PROCESSING_S * _TICKS_PER_S)
        bodies = [natnet.Body(self._ids[b.name], b.place, b.quaternion, b.inside) for b in self._seen.frame(now_s)]
        return natnet.Frame(self._frames, tuple(bodies), exposed, sent)
