"""An AR.Drone at the wire: UDP 5554 (navdata), 5556 (AT commands) and its lesser ports, at its own loopback address."""

import selectors
import socket
from collections.abc import Sequence

from groundstation.errors import GroundStationError
from sim_bridge.devices.ardrone_control import FlightControl
from sim_bridge.devices.ardrone_edge import ArDroneEdge
from sim_bridge.devices.ardrone_firmware import DEFAULT, FIRMWARES, ArdroneFirmware
from sim_bridge.devices.ardrone_navdata import NavdataWriter
from sim_bridge.devices.ardrone_ports import Ports, open_shared_udp
from sim_bridge.devices.ardrone_state import state_word
from sim_bridge.devices.ardrone_subscribers import Listener
from sim_bridge.devices.ardrone_video_mode import VideoMode
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.ardrone_sensors import Onboard
from sim_bridge.world.world import TICK_NS
from sim_bridge.wrong_values import WrongValues

NAVDATA_PORT = 5554
AT_PORT = 5556
# WIRE: demo mode sends every 13th of the 200 Hz packets: 15.4 Hz.
DEMO_SUBSAMPLING = 13
_LARGEST_DATAGRAM = 2048
# Programs that land in a loop without a pause send 19,000 datagrams a second: 95 in a tick.
_DATAGRAMS_PER_TICK = 256
_RECEIVE_BUFFER = 1 << 20


class ArDroneEmulator:
    """The sockets of one drone of the world: `receive`, then a step of the world, then `send`, once per tick.

    `silent` stops the navdata, `deaf` drops received datagrams, `wrong` changes the reported values (faults). Times
    are the world's, so a frozen bridge does not count its own pause as 2 s of silence.
    """

    def __init__(
        self,
        name: str,
        address: str,
        drone: Quadrotor,
        onboard: Onboard,
        navdata_hz: float = 200.0,
        firmware: ArdroneFirmware = FIRMWARES[DEFAULT],
        wrong: WrongValues | None = None,
    ) -> None:
        self.name = name
        self.silent = False
        self.deaf = False
        self.control = FlightControl(drone, onboard, firmware)
        self._drone = drone
        self._edge = ArDroneEdge(drone, onboard, self.control, wrong)
        self._subsampling = max(1, round(200.0 / navdata_hz))
        self._writer = NavdataWriter(firmware)
        self._ticks = 0
        self._selector = selectors.DefaultSelector()
        self._sockets: list[socket.socket] = []
        self._ports: Ports | None = None
        try:
            self._navdata = self._open(address, NAVDATA_PORT, self._take_requests)
            self._at = self._open(address, AT_PORT, self._take_commands)
            self._ports = Ports(name, address, self._selector, firmware.version)
        except GroundStationError:
            self.close()
            raise

    def suffer(self, kind: FaultKind, lasting: Sequence[Fault]) -> None:
        """Take the faults of this device: something holds a propeller."""
        if kind is FaultKind.PROPELLER_BLOCKED:
            self.control.blocked = bool(lasting)

    @property
    def video_settings(self) -> VideoMode:
        """Return the video settings of its configuration."""
        return VideoMode.configured(self.control.configuration.integer)

    def fileno(self) -> int:
        """Return a descriptor that is readable when input waits."""
        return self._selector.fileno()

    def receive(self) -> None:
        """Take the waiting input of all ports, without blocking."""
        for key, mask in self._selector.select(0):
            key.data(mask)

    def send(self) -> None:
        """End a tick: watch the link, and send due output."""
        self._ticks += 1
        control, now_ns = self.control, self._now_ns
        control.watch(now_ns)
        self._edge.step(now_ns)
        if control.dump_wanted or control.custom_dump_wanted:
            self._dump()
        listeners = list(control.audience)
        if not listeners:
            return
        demo_due, demo = self._ticks % DEMO_SUBSAMPLING == 0, control.demo
        due = demo_due if demo else self._ticks % self._subsampling == 0
        status = control.status_wanted and (demo or control.audience.bootstrap)
        control.status_wanted = False
        ready = [listener for listener in listeners if not listener.bootstrap]
        for listener in listeners:
            if status or (listener.bootstrap and demo_due):
                self._send_status(listener)
        if ready and due and not status:
            self._send_readings(ready)
        if status or (due if ready else demo_due):
            control.session.sent()

    def close(self) -> None:
        """Close all ports; idempotent."""
        for udp in self._sockets:
            udp.close()
        self._sockets.clear()
        if self._ports is not None:
            self._ports.close()
            self._ports = None
        self._selector.close()

    @property
    def _now_ns(self) -> int:
        return self._ticks * TICK_NS

    def _open(self, address: str, port: int, reader: object) -> socket.socket:
        udp = open_shared_udp(self.name, address, port)
        udp.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER)
        self._sockets.append(udp)
        self._selector.register(udp, selectors.EVENT_READ, reader)
        return udp

    def _take_requests(self, _mask: int) -> None:
        """Take navdata requests: any bytes request packets for their sender."""
        for _, client in _waiting(self._navdata):
            if not self.deaf:
                listener = self.control.audience.request(client, self._now_ns)
                if listener is not None:
                    self._send_status(listener)

    def _take_commands(self, _mask: int) -> None:
        """Take AT datagrams."""
        now_ns = self._now_ns
        for datagram, _ in _waiting(self._at):
            if not self.deaf:
                self.control.obey_datagram(datagram, now_ns)

    def _dump(self) -> None:
        """Answer CTRL 4 and 6, once a client has connected to the control port."""
        control, ports = self.control, self._ports
        if ports is None or not ports.control.connected:
            return
        if control.dump_wanted:
            ports.control.dump(control.configuration)
        if control.custom_dump_wanted:
            ports.control.custom_dump(control.configuration)
        control.dump_wanted = control.custom_dump_wanted = False
        if not control.session.answering_config:
            control.session.clear_ack()  # WIRE: the bit is set during the transfer

    def _send_status(self, listener: Listener) -> None:
        word = state_word(self._drone, self.control, self._now_ns, listener.bootstrap)
        self._send(listener, self._writer.status(word, listener.next_sequence()))

    def _send_readings(self, listeners: list[Listener]) -> None:
        control = self.control
        state, readings, ticks = self._edge.reported(self._ticks)
        first, *others = listeners
        if control.demo:
            mask = control.configuration.integer("general:navdata_options")
            packet = self._writer.demo(mask, state, readings, ticks, first.next_sequence())
        else:
            packet = self._writer.full(state, readings, ticks, first.next_sequence())
        self._send(first, packet)
        for listener in others:
            self._send(listener, self._writer.again(listener.next_sequence()))

    def _send(self, listener: Listener, packet: bytearray) -> None:
        if not self.silent:
            try:
                self._navdata.sendto(packet, listener.address)
            except OSError:
                return  # a full buffer or a vanished client loses packets, as radio does


def _waiting(udp: socket.socket) -> list[tuple[bytes, tuple[str, int]]]:
    datagrams = []
    for _ in range(_DATAGRAMS_PER_TICK):
        try:
            datagrams.append(udp.recvfrom(_LARGEST_DATAGRAM))
        except OSError:
            break
    return datagrams
