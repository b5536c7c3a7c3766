"""A scripted drone on loopback UDP whose bytes are assembled here by hand, and a driver with a bus around it."""

import itertools
import os
import re
import socket
import struct
import threading
import time
from contextlib import suppress

import pytest

from drivers.ardrone.driver import ArDrone
from drivers.ardrone.settings import ArDroneDriverSettings
from drivers.authority import AuthorityLimits
from drivers.host import VehicleHost
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import Command, Lease, Severity, VelocitySetpoint, Verb
from groundstation.bus.topics import (
    COMMAND,
    COMMAND_ACK,
    IMU,
    LEASE,
    ODOMETRY,
    RAW_RX,
    RAW_TX,
    SETPOINT,
    VEHICLE_STATUS,
)

S = 1_000_000_000
FLY, COMMAND_BIT, BOOTSTRAP, EMERGENCY = 1 << 0, 1 << 6, 1 << 11, 1 << 31
_numbers = itertools.count(1)


def checked(body: bytes) -> bytes:
    return body + struct.pack("<HHI", 0xFFFF, 8, sum(body))


class ScriptedTcp:
    """FTP with a version.txt on 5551 and the control port 5559, each for one client at a time."""

    def __init__(self, address: str, version: str) -> None:
        self.address, self.version = address, version
        self.clients: list[socket.socket] = []
        self.ftp, self.control = (socket.create_server((address, port)) for port in (5551, 5559))
        for serve in (self._serve_ftp, self._serve_control):
            threading.Thread(target=serve, daemon=True).start()

    def close(self) -> None:
        for listening in (self.ftp, self.control, *self.clients):
            with suppress(OSError):
                listening.shutdown(socket.SHUT_RDWR)
            listening.close()

    def _serve_ftp(self) -> None:
        with suppress(OSError):
            while True:
                client, _ = self.ftp.accept()
                with client:
                    self._speak_ftp(client)

    def _speak_ftp(self, client: socket.socket) -> None:
        data = socket.create_server((self.address, 0))
        high, low = divmod(data.getsockname()[1], 256)
        answers = {
            "USER": "331 go on",
            "PASS": "230 in",
            "TYPE": "200 binary",
            "PASV": f"227 Entering Passive Mode ({self.address.replace('.', ',')},{high},{low})",
            "RETR": "150 here it comes",
            "QUIT": "221 bye",
        }
        client.sendall(b"220 ready\r\n")
        with data, client.makefile("r", encoding="ascii", newline="\r\n") as lines:
            for line in lines:
                client.sendall((answers.get(line[:4], "502 what?") + "\r\n").encode())
                if line.startswith("RETR version.txt"):
                    stream, _ = data.accept()
                    with stream:
                        stream.sendall(f"{self.version}\n".encode())
                    client.sendall(b"226 done\r\n")

    def _serve_control(self) -> None:
        with suppress(OSError):
            while True:
                self.clients.append(self.control.accept()[0])

    def dump(self, config: dict[str, str]) -> None:
        values = {
            "general:num_version_soft": self.version,
            "general:drone_serial": "PS721000AB2L01234",
            "network:wifi_mode": "0",
            "network:owner_mac": "00:00:00:00:00:00",
            "control:accs_gains": "{ 1.0000000e+00 0.0000000e+00\n0.0000000e+00 }",
        } | config
        text = "".join(f"{key} = {value}\n" for key, value in values.items()).encode() + b"\0"
        for client in self.clients:
            with suppress(OSError):
                client.sendall(text)


class ScriptedDrone:
    """Two sockets and a state: acknowledges CONFIG, takes off and lands at once, remembers every command line."""

    def __init__(self) -> None:
        pid = os.getpid()
        self.address = f"127.{10 + pid % 90}.{pid // 90 % 250}.{next(_numbers)}"
        self.navdata, self.at = self._open(5554), self._open(5556)
        self.client: tuple[str, int] | None = None
        self.requests = 0
        self.sequence = 0
        self.state = BOOTSTRAP
        self.major = 2
        self.psi = self.force_mg = 0.0
        self.select = False
        self.lines: list[tuple[str, int, str]] = []
        self.config: dict[str, str] = {}
        self.deaf_to: set[str] = set()
        self.tcp: ScriptedTcp | None = None

    def _open(self, port: int) -> socket.socket:
        udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        udp.bind((self.address, port))
        udp.setblocking(False)
        return udp

    def close(self) -> None:
        self.navdata.close()
        self.at.close()
        if self.tcp is not None:
            self.tcp.close()

    def packet(self, theta: float = 1000.0) -> bytes:
        self.sequence += 1
        body = struct.pack("<IIII", 0x55667788, self.state, self.sequence, 0)
        if self.state & BOOTSTRAP:
            return checked(body)
        altitude = 800 if self.state & FLY else 0
        demo = struct.pack(
            "<HHIIfffifffI", 0, 148, self.major << 16, 80, theta, 500.0, self.psi, altitude, 300.0, 200.0, 0, 0
        )
        phys = struct.pack("<HHfH6fIII", 3, 46, 40.0, 0, self.force_mg, 0.0, -1000.0, 1.0, 2.0, 3.0, 0, 0, 0)
        return checked(body + demo.ljust(148, b"\0") + phys)

    def turn(self) -> None:
        """Take what came, and stream one packet."""
        for _, source in self._waiting(self.navdata):
            self.client, self.requests = source, self.requests + 1
        for datagram, _ in self._waiting(self.at):
            assert len(datagram) <= 1000 and datagram.endswith(b"\r")
            for line in datagram.decode("ascii").split("\r")[:-1]:
                match = re.fullmatch(r"AT\*(\w+)=(\d+),?(.*)", line)
                assert match, line
                self.obey(match[1], int(match[2]), match[3])
        if self.client is not None:
            self.navdata.sendto(self.packet(), self.client)

    @staticmethod
    def _waiting(udp: socket.socket) -> list[tuple[bytes, tuple[str, int]]]:
        came = []
        while True:
            try:
                came.append(udp.recvfrom(2048))
            except BlockingIOError:
                return came

    def obey(self, name: str, sequence: int, arguments: str) -> None:
        self.lines.append((name, sequence, arguments))
        if name == "CONFIG" and not self.state & COMMAND_BIT:
            key, value = arguments.replace('"', "").split(",")
            if key not in self.deaf_to:
                self.config[key] = value
            self.state = (self.state | COMMAND_BIT) & ~BOOTSTRAP
        if name == "CTRL" and arguments.startswith("5"):
            self.state &= ~COMMAND_BIT
        if name == "CTRL" and arguments == "4,0" and self.tcp is not None:
            self.tcp.dump(self.config)
            self.state |= COMMAND_BIT
        if name == "REF":
            bits = int(arguments)
            if bits & 0x100 and not self.select:
                self.state ^= EMERGENCY
                self.state &= ~FLY
            elif not self.state & EMERGENCY:
                self.state = self.state | FLY if bits & 0x200 else self.state & ~FLY
            self.select = bool(bits & 0x100)
            self.major = 4 if self.state & FLY else 2

    def said(self, name: str) -> list[str]:
        return [arguments for who, _, arguments in self.lines if who == name]


class Process:
    """What `Child` offers, without a process."""

    def __init__(self, bus: MemoryBus, section: str = "{}") -> None:
        self.name, self.bus, self.section = bus.source, bus, section
        self.stop_requested, self.supervisor_alive, self.supervisor_fresh = False, True, True
        self.events: list[tuple[Severity, str, str]] = []
        self.states: list[str] = []
        self.beats = 0
        self.on_sleep = lambda: None

    def beat(self) -> None:
        self.beats += 1

    def ready(self, detail: str = "") -> None:
        self.states.append(f"READY {detail}")

    def degrade(self, detail: str) -> None:
        self.states.append(f"DEGRADED {detail}")

    def tick_status(self, ticks: int = 0, overruns: int = 0, overflowed: int = 0) -> None:
        pass

    def sleep_until(self, deadline_ns: int) -> bool:
        self.on_sleep()
        return True

    def event(self, severity, text, remedy="", entity=None) -> None:
        self.events.append((severity, text, remedy))


class Rig:
    """Scripted drone, driver, and somebody on the other end of the bus."""

    def __init__(self, version: str = "", **settings) -> None:
        exchange = MemoryExchange()
        self.other = MemoryBus(exchange, "lab", "other")
        self.process = Process(MemoryBus(exchange, "lab", "ardrone_drone_1"))
        self.heard = {
            topic: self.other.subscribe([topic])
            for topic in (ODOMETRY, IMU, VEHICLE_STATUS, COMMAND_ACK, RAW_RX, RAW_TX)
        }
        self.fake = ScriptedDrone()
        if version:
            self.fake.tcp = ScriptedTcp(self.fake.address, version)
        self.settings = ArDroneDriverSettings(
            name="drone_1", address=self.fake.address, odometry_hz=200, imu_hz=200, **settings
        )
        self.drone = ArDrone(self.settings, self.process.bus)
        self.host = VehicleHost(self.process, self.drone, AuthorityLimits())
        self.speaking = True
        self.tracking = False
        self.ids = itertools.count()

    def close(self) -> None:
        self.drone.close()
        self.fake.close()

    def turn(self, settle: bool = True) -> None:
        """One cycle of drone and driver, 10 ms apart or so."""
        if self.speaking:
            before = self.drone.telemetry.heard_ns
            self.fake.turn()
            deadline = time.monotonic() + 0.5
            while settle and self.fake.client and self.drone.telemetry.heard_ns == before:
                assert time.monotonic() < deadline, "the driver does not hear the drone"
                time.sleep(0.0005)
        now = time.monotonic_ns()
        self.other.publish(LEASE, Lease(header=self.other.header("team"), holder="op", expires_ns=now + S))
        if self.tracking:
            message = VelocitySetpoint(
                header=self.other.header("drone_1"),
                velocity_m_s=(0.5, 0.0, 0.0),
                yaw_rate_rad_s=0.0,
                lifetime_ms=300,
                epoch=1,
            )
            self.other.publish(SETPOINT, message)
        self.decision = self.host.turn(time.monotonic_ns())

    def until(self, condition, limit_s: float = 5.0) -> None:
        deadline = time.monotonic() + limit_s
        while not condition():
            assert time.monotonic() < deadline, "it never came true"
            self.turn()
            time.sleep(0.001)

    def order(self, verb: Verb, scope=()) -> str:
        name = f"c{next(self.ids)}"
        message = Command(
            header=self.other.header("team"),
            id=name,
            verb=verb,
            scope=scope,
            issuer="op",
            expires_ns=time.monotonic_ns() + 5 * S,
        )
        self.other.publish(COMMAND, message)
        return name

    def messages(self, topic):
        return [received.message for received in self.heard[topic].drain()]

    def connect(self) -> "Rig":
        self.until(lambda: self.drone._session.phase == "READY")
        self.turn()
        self.turn()
        return self

    def take_off(self) -> "Rig":
        self.connect()
        self.order(Verb.TAKEOFF)
        self.until(lambda: self.decision.mode == "HOVER")
        return self


@pytest.fixture
def rig():
    rig = Rig()
    yield rig
    rig.close()


@pytest.fixture
def new_rig():
    """Build rigs: version of the firmware ("": no TCP ports), and settings of the driver."""
    rigs = []

    def build(version="", **settings):
        rigs.append(Rig(version, **settings))
        return rigs[-1]

    yield build
    for rig in rigs:
        rig.close()


@pytest.fixture
def drone_alone():
    """Build scripted drones that stream by themselves 200 times a second; version of the firmware as above."""
    drones, ended = [], threading.Event()

    def live(drone):
        while not ended.wait(0.005):
            drone.turn()

    def build(version="", state=BOOTSTRAP):
        drone = ScriptedDrone()
        drone.state = state
        if version:
            drone.tcp = ScriptedTcp(drone.address, version)
        thread = threading.Thread(target=live, args=(drone,), daemon=True)
        drones.append((drone, thread))
        thread.start()
        return drone

    yield build
    ended.set()
    for drone, thread in drones:
        thread.join(1)
        drone.close()


@pytest.fixture
def process_on():
    """The class of a process to hand to `run`."""
    return Process
