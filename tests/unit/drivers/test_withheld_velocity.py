"""Velocities that cannot be true, or that nothing confirms yet, are not published, by any kind of driver."""

import math
import random
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from drivers.ardrone.convert import NavdataMotion
from drivers.ardrone.driver import LIMITS as ARDRONE
from drivers.ardrone.publisher import NavdataPublisher
from drivers.ardrone.settings import ArDroneDriverSettings
from drivers.mavlink.convert import LIMITS as MAVLINK
from drivers.mavlink.convert import BaseAttitude
from drivers.mavlink.publisher import TelemetryPublisher
from drivers.mavlink.settings import VehicleSettings
from drivers.plausibility.health import Finding, Health, HealthReport, Sensor
from drivers.plausibility.motion import MotionMonitor, MotionSample
from drivers.tello.driver import LIMITS as TELLO
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import FlightState, Odometry
from groundstation.bus.topics import ODOMETRY

MS = 1_000_000
S = 1_000_000_000
WITHHELD = HealthReport((Finding(Sensor.VELOCITY, Health.SUSPECT, "its velocity jumps by 9.0 m/s"),), withheld=True)
DOUBTED = HealthReport(WITHHELD.findings)


class Flight:
    """A flight of one vehicle with noise on everything; velocities are added to its own."""

    def __init__(self, limits: Any, period_ms: int) -> None:
        self._monitor, self._period_ns = MotionMonitor(limits), period_ms * MS
        self._rng, self._now_ns = random.Random(1), S

    def report(self, forward: float = 0.0, climb: float = 0.0) -> HealthReport:
        self._now_ns += self._period_ns
        velocity = (0.3 + forward + self._rng.gauss(0, 0.02), self._rng.gauss(0, 0.02))
        tilt = [self._rng.gauss(0, 0.003) for _ in range(2)]
        sample = MotionSample(self._now_ns, velocity, tilt[0], tilt[1], climb_m_s=climb)
        return self._monitor.update(sample, FlightState.FLYING)

    def withheld(self, *forward: float) -> list[bool]:
        return [self.report(one).withheld for one in forward]


@pytest.mark.parametrize(("limits", "period_ms"), [(ARDRONE, 5), (MAVLINK, 20), (TELLO, 100)])
def test_an_impossible_velocity_is_withheld_while_it_lasts_and_no_longer(limits: Any, period_ms: int) -> None:
    flight = Flight(limits, period_ms)
    assert not any(flight.withheld(*[0.0] * 50))
    assert flight.withheld(99.0, 99.0, 99.0, 0.0, 0.0) == [True, True, True, False, False]
    assert flight.report(climb=-99.0).withheld and not flight.report().withheld


@pytest.mark.parametrize(("limits", "period_ms"), [(ARDRONE, 5), (MAVLINK, 20), (TELLO, 100)])
def test_a_jump_waits_for_its_confirmation(limits: Any, period_ms: int) -> None:
    flight = Flight(limits, period_ms)
    flight.withheld(*[0.0] * 50)
    assert flight.withheld(4.0, 0.0, 0.0) == [True, False, False], "a single wrong value"
    assert flight.withheld(4.0, 4.0, 4.0) == [True, False, False], "it goes on so: doubted, but used"
    report = flight.report(4.0)
    assert report.of(Sensor.VELOCITY) is not Health.GOOD


def test_an_impossible_velocity_confirms_no_jump() -> None:
    flight = Flight(MAVLINK, 20)
    flight.withheld(*[0.0] * 50)
    assert flight.withheld(8.1, 7.5, 7.5) == [True, True, False]


def test_none_of_a_recorded_flight_is_withheld(real_data: Any) -> None:
    flight = np.load(real_data("ardrone_flight") / "flight.npz")
    monitor = MotionMonitor(ARDRONE)
    for at, velocity, rotation in zip(
        flight["nav_time_s"], flight["nav_velocity_mm_s"], flight["nav_rotation_deg"], strict=True
    ):
        roll, pitch = math.radians(rotation[0]), math.radians(rotation[1])
        sample = MotionSample(round(at * 1e9), (velocity[0] / 1000, velocity[1] / 1000), roll, pitch)
        state = FlightState.FLYING if at > 4.1 else FlightState.LANDED
        assert not monitor.update(sample, state).withheld, at


def ardrone(bus: Any) -> Callable[[int, HealthReport], None]:
    publisher = NavdataPublisher(ArDroneDriverSettings(name="drone_1", address="127.0.0.1"), bus)
    motion = NavdataMotion((0.1, 0.0, 0.0), 0.0, 0.0, 0.0, 1.0, (0.0, 0.0, 0.0), (0.0, 0.0, 9.8))
    return lambda now_ns, health: publisher.publish(now_ns, motion, health)


def mavlink(bus: Any) -> Callable[[int, HealthReport], None]:
    publisher = TelemetryPublisher(VehicleSettings(name="px4_1", system_id=1, flavour="px4"), bus)
    attitude = BaseAttitude(0.0, 0.0, 0.0, (0.0, 0.0, 0.0))
    return lambda now_ns, health: publisher.velocity(now_ns, (0.1, 0.0, 0.0), attitude, health)


@pytest.mark.parametrize("kind", [ardrone, mavlink])
def test_a_withheld_velocity_is_not_published_and_a_doubted_one_as_uncertain(
    kind: Callable[[Any], Callable[[int, HealthReport], None]],
) -> None:
    exchange = MemoryExchange()
    heard = MemoryBus(exchange, "lab", "tracker").subscribe([ODOMETRY])
    publish = kind(MemoryBus(exchange, "lab", "drone_1"))
    publish(S, WITHHELD)
    assert not heard.drain()
    publish(2 * S, DOUBTED)
    (told,) = (one.message for one in heard.drain())
    assert isinstance(told, Odometry)
    assert told.velocity_covariance[0] == pytest.approx(0.25)
