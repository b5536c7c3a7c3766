"""Messages from 200 packets a second: every second odometry, and the mean of all IMU samples."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest

from drivers.ardrone.convert import NavdataMotion
from drivers.ardrone.publisher import NavdataPublisher
from drivers.ardrone.settings import ArDroneDriverSettings
from drivers.plausibility.health import Finding, Health, HealthReport, Sensor
from groundstation.bus.messages import ImuSample, Odometry

_PERIOD_NS = 5_000_000


def _motion(turn_rad_s: float, force_m_s2: float = 0.0) -> NavdataMotion:
    return NavdataMotion((0.1, 0.0, 0.0), 0.0, 0.0, 0.0, 1.0, (0.0, 0.0, turn_rad_s), (force_m_s2, 0.0, 9.8))


@pytest.fixture
def bus(new_bus: Callable[[], Any]) -> Any:
    return new_bus()


@pytest.fixture
def publisher(bus: Any) -> NavdataPublisher:
    return NavdataPublisher(ArDroneDriverSettings(name="drone_1", address="127.0.0.1"), bus)


def test_mean_rates_turn_as_far_as_all_samples_did(bus: Any, publisher: NavdataPublisher) -> None:
    turned = {0: 0.0}
    for i in range(201):
        rate, before_ns = 0.01 * ((7 * i) % 13), i * _PERIOD_NS
        turned[before_ns + _PERIOD_NS] = turned[before_ns] + rate * _PERIOD_NS * 1e-9
        publisher.publish(before_ns + _PERIOD_NS, _motion(rate, force_m_s2=0.1 * (i % 2)))
    samples = [message for message in bus.sent if isinstance(message, ImuSample)]
    odometry = [message for message in bus.sent if isinstance(message, Odometry)]
    assert len(samples) == 26 and len(odometry) == 51
    stamps = [0, *(sample.header.stamp_ns for sample in samples)]
    spans = [(after - before) * 1e-9 for before, after in pairwise(stamps)]
    told = sum(sample.angular_velocity_rad_s[2] * span for sample, span in zip(samples, spans, strict=True))
    assert told == pytest.approx(turned[stamps[-1]])
    assert samples[5].specific_force_m_s2[0] == pytest.approx(0.05), "of eight samples, four each"


def test_samples_of_a_bad_imu_are_in_no_mean(bus: Any, publisher: NavdataPublisher) -> None:
    stuck = HealthReport((Finding(Sensor.IMU, Health.BAD, "its IMU is stuck"),))
    publisher.publish(_PERIOD_NS, _motion(0.0))
    for i in range(2, 20):
        publisher.publish(i * _PERIOD_NS, _motion(9.0), stuck)
    publisher.publish(20 * _PERIOD_NS, _motion(1.0))
    told = [message.angular_velocity_rad_s[2] for message in bus.sent if isinstance(message, ImuSample)]
    assert told == [0.0, 1.0]
