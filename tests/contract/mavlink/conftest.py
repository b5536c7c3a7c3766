"""An emulated vehicle, the driver and a stand-in for the tracker on one manual clock, without sockets or threads.

Bytes go through both codecs; 20 s of flight take about a second.
"""

import itertools
import math
import sys
from collections import deque
from pathlib import Path

import numpy as np
import pytest

from drivers.host import VehicleHost
from drivers.mavlink.driver import RATE_HZ
from drivers.mavlink.links.refusals import LinkRefusals
from drivers.mavlink.links.seam import Heard
from drivers.mavlink.settings import MavlinkDriverSettings
from drivers.mavlink.vehicle import MavlinkVehicle
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.flight import CommandLong, SetPositionTargetLocalNed
from drivers.mavlink.wire.frames import FrameDecoder, FrameEncoder, split
from drivers.mavlink.wire.names import Flavour
from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import Command, EntityEstimate, Estimate, Lease, VelocitySetpoint, Verb
from groundstation.bus.topics import (
    COMMAND,
    COMMAND_ACK,
    ESTIMATE,
    IMU,
    LEASE,
    ODOMETRY,
    SETPOINT,
    VEHICLE_STATUS,
)
from sim_bridge.devices import mavlink
from sim_bridge.devices.mavlink import MavlinkEmulator
from sim_bridge.devices.mavlink_parameters import Parameters
from sim_bridge.mavlink_scenario import CopterScenario
from sim_bridge.world.mavlink_copter import ARDUPILOT_RESPONSE, PX4_RESPONSE, MavlinkCopter
from sim_bridge.world.world import TICK_NS, TICK_S

sys.path.insert(0, str(Path(__file__).parents[1]))  # for the helper modules of that folder
from mavlink_process import FakeProcess

S = 1_000_000_000
TURN_S = 1.0 / RATE_HZ
TURN_TICKS = round(TURN_S / TICK_S)
GROUND = ("127.0.0.1", 14999)


class FakeSocket:
    """Collects the emulator's datagrams."""

    def __init__(self):
        self.sent = deque[bytes]()

    def sendto(self, data, address):
        self.sent.append(bytes(data))

    def recvfrom(self, size):
        raise BlockingIOError

    def close(self):
        pass


class DirectLink:
    """A Link to an emulator in the same thread."""

    called_from, newest_stamp = (), 0

    def __init__(self, emulator, system=255):
        self.rejected = LinkRefusals()
        self.emulator = emulator
        self.encoder, self.decoder = FrameEncoder(system, 190), FrameDecoder()
        self.sent = []
        self.cut = False

    def receive(self):
        heard = []
        while self.emulator.socket.sent:
            for raw in split(self.emulator.socket.sent.popleft()):
                try:
                    heard.append(Heard(clock.now_ns(), self.decoder.decode(raw)))
                except WireError as error:
                    self.rejected[error.reason] += 1
        return [] if self.cut else heard

    def lose(self):
        """Drop the emulator's datagrams since the last call."""
        self.emulator.socket.sent.clear()

    def send(self, system, message):
        self.sent.append((clock.now_ns(), message))
        if not self.cut:
            self.emulator.take(self.encoder.encode(message), GROUND)

    def close(self):
        pass


class Rig:
    """A vehicle of a flavour at (0.5, -0.3), heading 0.4 rad, with driver and tracker stand-in."""

    def __init__(self, flavour, hand, seed=1, configured=True, scenario=None, **settings):
        self.hand = hand
        self.flavour = Flavour.PX4 if flavour == "px4" else Flavour.ARDUPILOT
        response = PX4_RESPONSE if flavour == "px4" else ARDUPILOT_RESPONSE
        self.rng = np.random.default_rng(seed)
        scenario = scenario or CopterScenario()
        self.copter = MavlinkCopter((0.5, -0.3), 0.4, scenario, response, TICK_S, self.rng)
        self.emulator = MavlinkEmulator("v", GROUND, Parameters(self.flavour, 11, configured), self.copter)
        self.link = DirectLink(self.emulator)
        exchange = MemoryExchange()
        self.other = MemoryBus(exchange, "lab", "tracker")
        self.process = FakeProcess(MemoryBus(exchange, "lab", "mavlink_v"))
        vehicle = {
            "name": "v",
            "system_id": 11,
            "flavour": flavour,
            "pad_m": (0.5, -0.3),
            "pad_yaw_rad": 0.4,
            **settings.pop("vehicle", {}),
        }
        self.settings = MavlinkDriverSettings.model_validate(
            {"link": {"target": "udpout:127.0.0.1:14550"}, "vehicles": [vehicle], "raw_datagrams": False, **settings}
        )
        self.vehicle = MavlinkVehicle(self.settings, self.settings.vehicles[0], self.link, self.process.bus)
        self.host = VehicleHost(self.process, self.vehicle, self.settings.authority(self.settings.vehicles[0]))
        self.heard = {
            t: self.other.subscribe([t], capacity=200000) for t in (ODOMETRY, IMU, VEHICLE_STATUS, COMMAND_ACK)
        }
        self.estimates = self.process.bus.subscribe([ESTIMATE])
        self.tracking = True  # the tracker lives
        self.sees = True  # cameras see the vehicle
        self.lingers = False  # the tracker has it on the floor, too
        self.driving = True  # the driver lives
        self.wanted = ((0.0, 0.0, 0.0), 0.0)
        self.offset_m, self.turned_rad = (0.0, 0.0, 0.0), 0.0  # errors of the estimate
        self.seen_s = 0.0
        self.epoch = 1
        self.noise_m = 0.01
        self.ids = itertools.count()
        self.texts = []

    @property
    def body(self):
        return self.copter.airframe

    @property
    def mode(self):
        return self.host.watchdog.mode

    def tick(self):
        """Advance everything by 5 ms; the host turns every 10 ms, and when an order asks for it."""
        self.hand.now += TICK_NS
        now = self.hand.now
        tick = self.emulator._ticks
        self.copter.step((0.0, 0.0, 0.0))
        self.copter.estimate.step(self.body, self.copter.motors_on)
        self.emulator.send()
        if self.driving:
            for heard in self.link.receive():
                self.vehicle.take(heard)
            if tick % 4 == 0:
                self.track(now)
            for received in self.estimates.drain():
                self.vehicle.see(now, received.message)
            if tick % TURN_TICKS == 0 or self.host.due_ns() <= now:  # as run_hosts
                self.host.turn(now)
            while self.vehicle.orders.events:
                self.texts.append(self.vehicle.orders.events.popleft()[1])
        else:
            self.link.lose()

    def track(self, now):
        self.seen_s = 0.0 if self.sees else self.seen_s + 0.02
        self.other.publish(LEASE, Lease(header=self.other.header("team"), holder="op", expires_ns=now + S))
        if not self.tracking:
            return
        b, sd = self.body, self.noise_m
        aloft = not b.on_ground or self.lingers
        entities: tuple[EntityEstimate, ...] = ()
        if aloft:
            x, y, z = (
                v + o + sd * self.rng.standard_normal() for v, o in zip((b.x, b.y, b.z), self.offset_m, strict=True)
            )
            covariance = np.diag([sd**2 + 1e-4 + 0.0014 * self.seen_s] * 3 + [1e-3]).ravel().tolist()
            entities = (
                EntityEstimate(
                    name="v", kind="robot", mean=(x, y, z, b.yaw + self.turned_rad), covariance=tuple(covariance),
                    velocity_m_s=(b.vx, b.vy, b.vz), converged=True, age_s=self.seen_s,
                ),
            )  # fmt: skip
        self.other.publish(
            ESTIMATE, Estimate(header=self.other.header("team", now), entities=entities, epoch=self.epoch)
        )
        if aloft:
            setpoint = VelocitySetpoint(
                header=self.other.header("v", now), velocity_m_s=self.wanted[0], yaw_rate_rad_s=self.wanted[1],
                lifetime_ms=300, epoch=self.epoch,
            )  # fmt: skip
            self.other.publish(SETPOINT, setpoint)

    def run(self, seconds):
        for _ in range(round(seconds / TICK_S)):
            self.tick()
        return self

    def until(self, condition, seconds=20.0):
        for _ in range(round(seconds / TICK_S)):
            if condition():
                return self
            self.tick()
        raise AssertionError(f"never came true; {self.mode} {self.host.watchdog.reason}; {self.texts[-5:]}")

    def order(self, verb):
        message = Command(
            header=self.other.header("team"), id=f"c{next(self.ids)}", verb=verb, scope=(), issuer="op",
            expires_ns=self.hand.now + 5 * S,
        )  # fmt: skip
        self.other.publish(COMMAND, message)
        return message.id

    def connect(self):
        return self.until(lambda: self.host.watchdog.mode == "LANDED" and not self.host.watchdog.vehicle.not_ready)

    def take_off(self):
        self.connect()
        self.order(Verb.TAKEOFF)
        self.until(lambda: self.mode == "HOVER")
        return self.until(lambda: self.body.z > 0.7 and abs(self.body.vz) < 0.1)

    def track_on(self):
        self.take_off()
        self.order(Verb.TRACK)
        return self.until(lambda: self.mode == "TRACK", 1.0)

    def messages(self, topic):
        return [received.message for received in self.heard[topic].drain()]

    def sent(self, kind=None):
        return [(at, m) for at, m in self.link.sent if kind is None or isinstance(m, kind)]

    def velocity(self):
        return (*self.body.velocity_stabilized(), self.body.vz)

    def mean_velocity(self, seconds):
        """Fly on and return the mean velocity: gusts and sensors disturb it by 0.1 m/s for a second."""
        flown = []
        for _ in range(round(seconds / TICK_S)):
            self.tick()
            flown.append(self.velocity())
        return tuple(np.mean(flown, axis=0))


class Hand:
    """The manual clock."""

    def __init__(self):
        self.now = 5_000 * S


@pytest.fixture
def hand(monkeypatch):
    hand = Hand()
    monkeypatch.setattr(clock, "now_ns", lambda: hand.now)
    monkeypatch.setattr(mavlink, "open_udp", lambda owner, address, port: FakeSocket())
    return hand


@pytest.fixture(params=["px4", "ardupilot"])
def flavour(request):
    return request.param


@pytest.fixture
def rig(flavour, hand):
    return Rig(flavour, hand)


@pytest.fixture
def rig_of(hand):
    """Make a rig: rig_of(flavour, ...)."""
    return lambda flavour, **options: Rig(flavour, hand, **options)


__all__ = ["CommandLong", "SetPositionTargetLocalNed", "math"]
