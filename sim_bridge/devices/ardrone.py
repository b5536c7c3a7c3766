"""An AR.Drone at the wire: UDP 5554 (navdata) and 5556 (AT commands) of its own loopback address."""

import socket
from contextlib import suppress

from groundstation.errors import GroundStationError
from sim_bridge.devices.ardrone_control import FlightControl
from sim_bridge.devices.ardrone_navdata import NavdataState, NavdataWriter
from sim_bridge.world.onboard import Onboard
from sim_bridge.world.quadrotor import Quadrotor
from sim_bridge.world.world import TICK_NS

NAVDATA_PORT = 5554
AT_PORT = 5556
# WIRE: demo mode sends every 13th of the 200 Hz packets: 15.4 Hz.
DEMO_SUBSAMPLING = 13
_LARGEST_DATAGRAM = 2048
_DATAGRAMS_PER_TICK = 64


class ArDroneEmulator:
    """Sockets around one drone of the world: `receive`, then a step of the world, then `send`, once per tick.

    `silent` stops the navdata, `deaf` drops what arrives (faults). Times are the world's, so a bridge that was
    frozen does not see 2 s of silence that nobody kept.
    """

    def __init__(self, name: str, address: str, drone: Quadrotor, onboard: Onboard, navdata_hz: float = 200.0) -> None:
        self.name = name
        self.silent = False
        self.deaf = False
        self.control = FlightControl(drone)
        self._drone, self._onboard = drone, onboard
        self._subsampling = max(1, round(200.0 / navdata_hz))
        self._writer = NavdataWriter()
        self._state = NavdataState()
        self._ticks = 0
        self.navdata_socket = _open(name, address, NAVDATA_PORT)
        try:
            self.at_socket = _open(name, address, AT_PORT)
        except GroundStationError:
            self.navdata_socket.close()
            raise

    def receive_navdata_requests(self) -> None:
        """Take all waiting navdata requests: any bytes ask for packets to where they came from."""
        for _, client in _waiting(self.navdata_socket):
            if not self.deaf and self.control.session.request(client, self._now_ns):
                self._send(self._status_packet())

    def receive_commands(self) -> None:
        """Take all waiting AT datagrams."""
        now_ns = self._now_ns
        for datagram, _ in _waiting(self.at_socket):
            if not self.deaf:
                self.control.obey_datagram(datagram, now_ns)

    def send(self) -> None:
        """End a tick: watch the link, and send what is due."""
        self._ticks += 1
        control = self.control
        control.watch(self._now_ns)
        if control.session.client is None:
            return
        demo = control.session.bootstrap or control.configuration.flag("general:navdata_demo")
        if control.status_wanted and demo:
            control.status_wanted = False
            self._send(self._status_packet())
        elif self._ticks % (DEMO_SUBSAMPLING if demo else self._subsampling) == 0:
            self._send(self._packet(demo))

    def close(self) -> None:
        """Close both ports."""
        self.navdata_socket.close()
        self.at_socket.close()

    @property
    def _now_ns(self) -> int:
        return self._ticks * TICK_NS

    def _status_packet(self) -> bytearray:
        return self._writer.status(self.control.state_word(self._now_ns), self.control.session.next_packet())

    def _packet(self, demo: bool) -> bytearray:
        control, state, session = self.control, self._state, self.control.session
        if session.bootstrap:
            return self._status_packet()
        state.word = control.state_word(self._now_ns)
        state.control_state = control.control_state(self._now_ns)
        state.motors_on = self._drone.autopilot.motors_on
        state.pcmd_sequence, state.at_sequence = control.pcmd_sequence, session.at_sequence
        if demo:
            mask = control.configuration.integer("general:navdata_options")
            return self._writer.demo(mask, state, self._onboard, self._ticks, session.next_packet())
        return self._writer.full(state, self._onboard, self._ticks, session.next_packet())

    def _send(self, packet: bytearray) -> None:
        client = self.control.session.client
        if client is not None and not self.silent:
            with suppress(OSError):  # a full buffer or a vanished client loses packets, as radio does
                self.navdata_socket.sendto(packet, client)
        self.control.session.sent()


def _open(name: str, address: str, port: int) -> socket.socket:
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    udp.setblocking(False)
    try:
        udp.bind((address, port))
    except OSError as error:
        udp.close()
        raise GroundStationError(
            f"emulated {name}: cannot listen on {address}:{port} (UDP): is another run using this address? ({error})"
        ) from error
    return udp


def _waiting(udp: socket.socket) -> list[tuple[bytes, tuple[str, int]]]:
    datagrams = []
    for _ in range(_DATAGRAMS_PER_TICK):
        try:
            datagrams.append(udp.recvfrom(_LARGEST_DATAGRAM))
        except OSError:
            break
    return datagrams
