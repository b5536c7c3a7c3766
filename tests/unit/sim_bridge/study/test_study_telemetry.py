"""At message level an AR.Drone publishes as its driver does: at the driver's rate, with every jump counted."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from drivers.ardrone.settings import ArDroneDriverSettings
from groundstation.bus.messages import Odometry
from sim_bridge.study.telemetry import TelemetryPublisher
from sim_bridge.world.world import TICK_NS, TICK_S

HZ = ArDroneDriverSettings.model_fields["odometry_hz"].default


def published(jump_at: int | None = None, phase: int = 0, ticks: int = 200) -> dict[int, Odometry]:
    """Return what is published at each tick; the heading jumps by half a radian at one of them."""
    sensors = SimpleNamespace(vx=0.1, vy=0.0, yaw=0.0, roll=0.0, pitch=0.0, height=0.8)
    publisher = TelemetryPublisher("drone_1", cast(Any, None), cast(Any, sensors), "study", phase)
    heard = {}
    for tick in range(ticks):
        sensors.yaw = 0.5 if jump_at is not None and tick >= jump_at else 0.0
        if (odometry := publisher.odometry(tick * TICK_NS)) is not None:
            heard[tick] = odometry
    return heard


def test_odometry_comes_at_the_rate_of_the_driver() -> None:
    assert len(published()) == pytest.approx(200 * TICK_S * HZ)


def test_drones_of_a_team_publish_at_different_times() -> None:
    assert not set(published()) & set(published(phase=1))


@pytest.mark.parametrize("tick", range(50, 54))
def test_a_jump_of_the_heading_is_counted_once_whenever_it_comes(tick: int) -> None:
    resets = [odometry.reset for at, odometry in published(jump_at=tick).items() if at >= tick]
    assert set(resets) == {1}
    assert {odometry.reset for at, odometry in published(jump_at=tick).items() if at < tick} == {0}
