"""A Tello's driver without its loop, and an emulated Tello without a clock."""

import json
import socket
import time

import pytest

from drivers.tello.driver import Heard, Tello, velocity_from_state
from drivers.tello.settings import TelloDriverSettings
from drivers.tello.wire.text import COMMAND_PORT, STATE_PORT, State, parse_state
from drivers.watchdog_types import Action, DriverMode, WatchdogDecision
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import FlightState
from groundstation.bus.topics import ODOMETRY
from groundstation.vehicles import kind_named
from sim_bridge.conformance.subject import subject_of
from sim_bridge.devices.tello import TelloBody, TelloEmulator
from sim_bridge.scenario import Scenario, parse_scenario
from sim_bridge.site import SiteDrone
from sim_bridge.world.noise import generator_of

STATE = State(-3, 2, -120, (5, -4, 1), 71, 50, 82, 14, (17.0, -4.0, -956.0))
ADDRESS = "127.64.77.11"
DRONE = SiteDrone.model_validate(
    {"kind": "tello", "pad_m": (0.0, 0.0), "pad_yaw_deg": 30.0, "marker": {"code": 1, "position_m": (0.0, 0.0, 0.08)}}
)


class Flight:
    """The driver's object between a bus and a vehicle that receives everything, without a loop."""

    def __init__(self) -> None:
        order = subject_of("tello").order()
        settings = TelloDriverSettings.model_validate_json(kind_named("tello").processes([order])[0].section)
        own = settings.tello.model_copy(update={"local_address": "127.64.78.1"})
        settings = settings.model_copy(update={"address": "127.64.78.11", "tello": own})
        self.heard = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.heard.bind((settings.address, COMMAND_PORT))
        self.heard.settimeout(1.0)
        exchange = MemoryExchange()
        self.tello = Tello(settings, MemoryBus(exchange, "lab", "tello"))
        self.odometry = MemoryBus(exchange, "lab", "tracker").subscribe([ODOMETRY])

    def told(
        self, action: Action, velocity=(0.0, 0.0, 0.0), turn=0.0, state=STATE, back=None
    ) -> tuple[bytes, FlightState]:
        """Return the messages to the vehicle for a decision, and the driver's flight state afterwards."""
        now_ns = time.monotonic_ns()
        self.tello._ready = True
        self.tello.heard = Heard(now_ns, now_ns, state, velocity_from_state(state))
        self.tello.apply(now_ns, WatchdogDecision(DriverMode.TRACK, action, velocity, turn, back_m_s=back))
        return self.heard.recv(64), self.tello.view(now_ns).flight_state

    def close(self) -> None:
        self.tello.close()
        self.heard.close()


@pytest.fixture
def flight():
    flight = Flight()
    yield flight
    flight.close()


class Rig:
    """The emulator with a client, alone in its world and without a clock."""

    def __init__(self) -> None:
        scenario: Scenario = parse_scenario(json.dumps({"mavlink": {"air_unrest_m_s2": 0.0}}))
        self.body = TelloBody(DRONE, scenario, 0.005, generator_of(1, "tello"))
        self.vehicle = TelloEmulator("tello", ADDRESS, self.body)
        self.partner = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.partner.bind(("127.64.77.1", 0))
        self.states = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.states.bind(("127.64.77.1", STATE_PORT))
        for udp in (self.partner, self.states):
            udp.settimeout(1.0)

    def say(self, words: bytes, seconds: float = 0.0) -> None:
        self.partner.sendto(words, (ADDRESS, COMMAND_PORT))
        time.sleep(0.001)
        self.vehicle.receive()
        self.turn(seconds)

    def turn(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.005)):
            self.body.step((0.0, 0.0, 0.0))
            self.body.sense()
            self.vehicle.send()

    def state(self) -> State:
        self.states.setblocking(False)
        last = b""
        while True:
            try:
                last = self.states.recv(2048)
            except BlockingIOError:
                return parse_state(last)

    def close(self) -> None:
        self.vehicle.close()
        self.partner.close()
        self.states.close()


@pytest.fixture
def rig():
    rig = Rig()
    yield rig
    rig.close()
