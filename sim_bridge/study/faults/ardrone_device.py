"""An emulated AR.Drone on the network in memory: navdata and AT commands, no TCP."""

from collections.abc import Sequence

from sim_bridge.devices.ardrone import AT_PORT, DEMO_SUBSAMPLING, NAVDATA_PORT
from sim_bridge.devices.ardrone_control import FlightControl
from sim_bridge.devices.ardrone_edge import ArDroneEdge
from sim_bridge.devices.ardrone_firmware import FIRMWARES, ArdroneFirmware
from sim_bridge.devices.ardrone_navdata import NavdataWriter
from sim_bridge.devices.ardrone_state import state_word
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.study.faults.memory_network import MemoryNetwork, MemorySocket
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.ardrone_sensors import Onboard
from sim_bridge.world.world import TICK_NS
from sim_bridge.wrong_values import WrongValues

_EVERY_TICKS = 2  # 100 Hz: twice as often as odometry is published
# The options that the driver reads; the others of a full packet would take half of a flight's computing time.
_SENT = frozenset({0, 1, 3, 6, 10, 16, 21})
_LARGEST = 2048


def slim(firmware: str) -> ArdroneFirmware:
    """Return the firmware with only the options that the driver reads."""
    full = FIRMWARES[firmware]
    return full.without(tuple(tag for tag in full.sizes if tag not in _SENT))


class MemoryArDrone:
    """An AR.Drone: `receive`, a step of the world, `send`, once per tick, like the emulator at real sockets."""

    def __init__(
        self, address: str, drone: Quadrotor, onboard: Onboard, firmware: str, wrong: WrongValues,
        network: MemoryNetwork,
    ) -> None:  # fmt: skip
        self.silent = self.deaf = False
        self._drone = drone
        emulated = slim(firmware)
        self.control = FlightControl(drone, onboard, emulated)
        self.edge = ArDroneEdge(drone, onboard, self.control, wrong)
        self._writer, self._ticks = NavdataWriter(emulated), 0
        self._navdata, self._at = MemorySocket(network), MemorySocket(network)
        for udp, port in ((self._navdata, NAVDATA_PORT), (self._at, AT_PORT)):
            udp.setblocking(False)
            udp.bind((address, port))

    def suffer(self, kind: FaultKind, lasting: Sequence[Fault]) -> None:
        """Take the faults of this device: something holds a propeller."""
        if kind is FaultKind.PROPELLER_BLOCKED:
            self.control.blocked = bool(lasting)

    def receive(self) -> None:
        """Take the waiting datagrams of both ports."""
        now_ns = self._ticks * TICK_NS
        for udp in (self._navdata, self._at):
            while udp.waiting:
                data, source = udp.recvfrom(_LARGEST)
                if self.deaf:
                    continue
                if udp is self._at:
                    self.control.obey_datagram(data, now_ns)
                else:
                    self.control.audience.request(source, now_ns)

    def send(self) -> None:
        """End a tick: watch the link, and send due output."""
        self._ticks += 1
        now_ns, control = self._ticks * TICK_NS, self.control
        control.watch(now_ns)
        self.edge.step(now_ns)
        control.dump_wanted = control.custom_dump_wanted = False
        for listener in control.audience:
            if listener.bootstrap:
                if self._ticks % DEMO_SUBSAMPLING:
                    continue
                packet = self._writer.status(
                    state_word(self._drone, control, now_ns, bootstrap=True), listener.next_sequence()
                )
            elif self._ticks % _EVERY_TICKS:
                continue
            else:
                state, readings, ticks = self.edge.reported(self._ticks)
                packet = self._writer.full(state, readings, ticks, listener.next_sequence())
            control.session.sent()
            if not self.silent:
                self._navdata.sendto(bytes(packet), listener.address)
