"""Test bench for the AR.Drone emulator: real loopback UDP, bytes assembled by hand, and a manual clock.

Neither the driver's encoders nor its decoders take part: offsets, signs and commands are written out here.
"""

import itertools
import os
import socket
import struct
from collections.abc import Iterator

import pytest

from sim_bridge.devices.ardrone import ArDroneEmulator
from sim_bridge.scenario import DroneScenario, Scenario
from sim_bridge.site import Site
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.world import World

TAKE_OFF, LAND = 290718208, 290717696
_addresses = itertools.count(1)


class Bench:
    """One emulated drone on its own address, a pair of client sockets, and a manual clock."""

    def __init__(self, scenario: DroneScenario | None = None) -> None:
        pid = os.getpid()
        self.address = f"127.{100 + pid % 100}.{pid // 100 % 250}.{next(_addresses)}"
        site = Site.model_validate(
            {
                "site": "lab",
                "room": {"size_m": [8, 6, 4.5]},
                "drones": {
                    "d": {
                        "kind": "ardrone",
                        "pad_m": [0, 0],
                        "marker": {"code": 1, "square_mm": 44, "position_m": [0, 0, 0]},
                    }
                },
                "target": {"name": "t", "marker": {"code": 5, "height_m": 0.4, "square_mm": 44}},
            }
        )
        self.world = World(site, Scenario(drones=scenario or DroneScenario()), 1)
        drone, onboard = self.world.of(Quadrotor)["d"], self.world.onboard["d"]
        self.body, self.autopilot = drone.airframe, drone.autopilot
        self.emulator = ArDroneEmulator("d", self.address, drone, onboard)
        self.navdata = self.client()
        self.at = self.client()
        self.sequence = 0
        self.packets: list[bytes] = []

    @staticmethod
    def client() -> socket.socket:
        udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        udp.bind(("127.0.0.1", 0))
        udp.setblocking(False)
        return udp

    def close(self) -> None:
        self.emulator.close()
        self.navdata.close()
        self.at.close()

    def tick(self, count: int = 1) -> list[bytes]:
        """Advance by 5 ms each and return the packets that came."""
        came = []
        for _ in range(count):
            self.emulator.receive()
            self.world.step()
            self.emulator.send()
            came += self.receive(self.navdata)
        self.packets += came
        return came

    def raw(self, datagram: bytes) -> None:
        self.at.sendto(datagram, (self.address, 5556))

    def say(self, *commands: str) -> None:
        """Send commands such as `REF,290718208` in one datagram."""
        lines = []
        for command in commands:
            self.sequence += 1
            name, _, arguments = command.partition(",")
            lines.append(f"AT*{name}={self.sequence}{',' + arguments if arguments else ''}\r")
        self.raw("".join(lines).encode())

    def request(self, payload: bytes = b"\x01\x00\x00\x00") -> None:
        self.navdata.sendto(payload, (self.address, 5554))

    def connect(self, demo: str = "FALSE") -> None:
        """Bootstrap until the drone streams."""
        self.request()
        self.say(f'CONFIG,"general:navdata_demo","{demo}"')
        self.tick(4 * 13)
        self.say("CTRL,5,0")
        self.tick(2)

    def keep(self, seconds: float, *commands: str) -> None:
        """Send commands every 30 ms for a while, as a driver does."""
        for _ in range(round(seconds / 0.03)):
            self.say(*(commands or ("COMWDG",)))
            self.tick(6)

    def fly(self) -> None:
        self.connect()
        self.keep(0.1, f"REF,{LAND}", "PCMD,0,0,0,0,0")
        self.keep(6.0, f"REF,{TAKE_OFF}", "PCMD,0,0,0,0,0")
        assert not self.body.on_ground

    @property
    def state(self) -> int:
        return int(struct.unpack_from("<I", self.packets[-1], 4)[0])

    @property
    def major(self) -> int:
        return self.demo()[0] >> 16

    def demo(self) -> tuple[int, int, float, float, float, int, float, float, float]:
        """Return control state, battery, theta, phi, psi [mdeg], altitude [mm], vx, vy, vz [mm/s]."""
        assert struct.unpack_from("<HH", self.packets[-1], 16) == (0, 148)
        return struct.unpack_from("<IIfffifff", self.packets[-1], 20)

    @staticmethod
    def receive(udp: socket.socket) -> list[bytes]:
        packets = []
        while True:
            try:
                packets.append(udp.recv(4096))
            except BlockingIOError:
                return packets

    @staticmethod
    def options(packet: bytes) -> list[tuple[int, int]]:
        found, offset = [], 16
        while offset < len(packet):
            tag, size = struct.unpack_from("<HH", packet, offset)
            found.append((tag, size))
            offset += size
        return found


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


@pytest.fixture
def weak_bench() -> Iterator[Bench]:
    made = Bench(DroneScenario(battery=(0.09, 0.09)))
    yield made
    made.close()
