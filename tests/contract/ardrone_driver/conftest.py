"""An AR.Drone driver on a memory bus, with a scripted drone at the other end of its sockets."""

import itertools
import sys
import threading
import time
from pathlib import Path

import pytest

from drivers.ardrone.driver import ArDrone
from drivers.ardrone.settings import ArDroneDriverSettings
from drivers.host import VehicleHost
from drivers.watchdog_types import WatchdogLimits
from groundstation.bus.api import Bus
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

sys.path.insert(0, str(Path(__file__).parent))  # for the helper modules of this folder
from scripted_drone import BOOTSTRAP, ScriptedDrone, ScriptedTcp

S = 1_000_000_000


class Process:
    """Stand-in for `Child`, without a process."""

    def __init__(self, bus: MemoryBus, section: str = "{}") -> None:
        self.name, self.section = bus.source, section
        self.bus: Bus = bus
        self.stop_requested, self.supervisor_alive, self.supervisor_fresh = False, True, True
        self.spoken_for_ns = 0
        self.events: list[tuple[Severity, str, str]] = []
        self.states: list[str] = []
        self.beats, self.finished = 0, False
        self.on_sleep = lambda: None

    def beat(self) -> None:
        self.beats += 1

    def ready(self, detail: str = "") -> None:
        self.states.append(f"READY {detail}")

    def degrade(self, detail: str, works: bool = True) -> None:
        self.states.append(f"DEGRADED {detail}")

    def note_addresses(self, addresses: object) -> None:
        pass

    def finish(self) -> None:
        self.finished = True

    def leave(self, number: int) -> None:
        pass

    def tick_status(self, ticks: int = 0, overruns: int = 0, overflowed: int = 0) -> None:
        pass

    def sleep_until(self, deadline_ns: int) -> bool:
        self.on_sleep()
        return True

    def wake(self) -> None:
        pass

    def event(self, severity, text, remedy="", entity=None) -> None:
        self.events.append((severity, text, remedy))


class Rig:
    """Scripted drone, driver, and a subscriber on the bus."""

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
        self.host = VehicleHost(self.process, self.drone, WatchdogLimits())
        self.speaking = True
        self.tracking = False
        self.ids = itertools.count()

    def close(self) -> None:
        self.drone.close()
        self.fake.close()

    def turn(self, settle: bool = True) -> None:
        """Turn drone and driver once, some 10 ms apart."""
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

    def track(self) -> None:
        """Let a drone that hovers fly by setpoints."""
        self.tracking = True
        self.order(Verb.TRACK)
        self.until(lambda: self.decision.action == "FLY")


@pytest.fixture
def rig():
    rig = Rig()
    yield rig
    rig.close()


@pytest.fixture
def new_rig():
    """Build rigs from the firmware's version ("": no TCP ports) and settings of the driver."""
    rigs = []

    def build(version="", **settings):
        rigs.append(Rig(version, **settings))
        return rigs[-1]

    yield build
    for rig in rigs:
        rig.close()


@pytest.fixture
def drone_alone():
    """Build scripted drones that stream by themselves 200 times a second; firmware version as above."""
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
    """Return the process class to pass to `run`."""
    return Process
