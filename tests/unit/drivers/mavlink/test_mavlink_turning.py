"""An attitude is extrapolated by the vehicle's body rates between two messages, for a limited time."""

import math

import numpy as np
import pytest

from drivers.mavlink.convert import BaseAttitude
from drivers.mavlink.latest_telemetry import LatestTelemetry
from drivers.mavlink.publisher import GyroHeading
from drivers.mavlink.turning import turned_on
from groundstation.geometry.rotations import euler_from_rotation, rotation_from_euler

MS = 1_000_000


def test_a_level_turn_changes_the_heading_only() -> None:
    turned = turned_on(BaseAttitude(0.0, 0.0, 3.1, (0.0, 0.0, 2.0)), 20 * MS)
    assert (turned.roll_rad, turned.pitch_rad) == (0.0, 0.0)
    assert turned.yaw_rad == pytest.approx(3.14)


@pytest.mark.parametrize("rates", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.4, -0.7, 0.9)])
def test_a_tilted_vehicle_turns_about_its_own_axes(rates: tuple[float, float, float]) -> None:
    attitude, seconds = BaseAttitude(0.3, -0.2, 0.5, rates), 0.004
    turned = turned_on(attitude, round(1e9 * seconds))
    p, q, r = seconds * np.array(rates)
    step = np.array([[1.0, -r, q], [r, 1.0, -p], [-q, p, 1.0]])
    wanted = euler_from_rotation(rotation_from_euler(0.3, -0.2, 0.5) @ step)
    assert (turned.roll_rad, turned.pitch_rad, turned.yaw_rad) == pytest.approx(wanted, abs=3e-5)


@pytest.mark.parametrize(("elapsed_ms", "counted_s"), [(-50, 0.0), (0, 0.0), (20, 0.02), (100, 0.1), (60_000, 0.1)])
def test_rates_hold_for_a_tenth_of_a_second(elapsed_ms: int, counted_s: float) -> None:
    turned = turned_on(BaseAttitude(0.0, 0.0, 0.0, (0.0, 0.0, 1.0)), elapsed_ms * MS)
    assert turned.yaw_rad == pytest.approx(counted_s)


def test_the_heading_of_a_velocity_is_that_of_its_time() -> None:
    heading, turning = GyroHeading(), BaseAttitude(0.0, 0.0, 0.0, (0.0, 0.0, 0.5))
    assert heading.at(7) == 0.0
    for step in range(11):
        heading.update(step * 20 * MS, turning)
    assert heading.at(200 * MS) == pytest.approx(0.1)
    assert heading.at(215 * MS) == pytest.approx(0.1075)
    assert heading.at(60_000 * MS) == pytest.approx(0.15)


def test_an_attitude_that_was_never_told_is_none() -> None:
    assert LatestTelemetry().attitude_at(MS) is None
    told = LatestTelemetry(attitude=BaseAttitude(0.1, 0.0, math.pi / 2, (0.0, 0.0, 0.0)), attitude_ns=5)
    assert told.attitude_at(10 * MS) == told.attitude


def test_a_restarted_driver_does_not_begin_at_a_heading_that_its_predecessor_told() -> None:
    first, second, turning = GyroHeading(), GyroHeading(), BaseAttitude(0.0, 0.0, 0.0, (0.0, 0.0, 0.5))
    for begins_s, heading in ((0, first), (60, second)):
        for step in range(50):
            heading.update(begins_s * 1000 * MS + step * 20 * MS, turning)
    before = first.resets
    first.update(3000 * MS, turning)
    assert first.resets == before + 1
    assert second.resets not in (before, first.resets)
