"""An AR.Drone's optical flow that loses the floor: a stop that no drone can do, or its own word."""

import random
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import pytest

from drivers.ardrone.flow_watch import FlowWatch

PACKET_NS = 5_000_000


class Packets:
    """Packets of one drone, one after the other."""

    def __init__(self) -> None:
        self.watch, self.now_ns = FlowWatch(), 0

    def __call__(self, speeds: Iterable[float], noise: float = 0.02, no_vision: bool = False) -> FlowWatch:
        draw = random.Random(1)
        for speed in speeds:
            self.now_ns += PACKET_NS
            velocity = (speed + draw.gauss(0.0, noise), draw.gauss(0.0, noise))
            self.watch.update(self.now_ns, velocity, no_vision)
        return self.watch


def braking(from_m_s: float, by_m_s2: float) -> list[float]:
    return [max(0.0, from_m_s - by_m_s2 * n * PACKET_NS / 1e9) for n in range(400)]


@pytest.mark.parametrize("noise", [0.0, 0.001, 0.03])
def test_a_velocity_that_drops_to_nothing_at_once_is_no_measurement_and_soon_the_floor_is_lost(noise: float) -> None:
    packets = Packets()
    packets([0.4] * 50)
    assert packets([0.0] * 5, noise).suspected and not packets.watch.lost
    assert packets([0.0] * 40, noise).lost
    packets.watch.reset()
    assert not packets.watch.lost


def test_a_drone_that_brakes_as_hard_as_it_can_has_not_lost_the_floor() -> None:
    packets = Packets()
    packets([0.6] * 50)
    assert not packets(braking(0.6, 2.06)).lost


def test_a_glitch_of_a_few_packets_is_none() -> None:
    packets = Packets()
    packets([0.4] * 50)
    packets([0.0] * 10)
    watch = packets([0.4] * 50)
    assert not watch.suspected and not watch.lost


def test_a_drone_that_says_for_a_while_that_it_sees_nothing_is_believed_until_a_second_after() -> None:
    packets = Packets()
    assert not packets([0.4] * 30, no_vision=True).lost
    assert packets([0.4] * 20, no_vision=True).lost
    assert packets([0.4] * 190).lost
    assert not packets([0.4] * 20).lost


def test_the_recorded_flight_never_loses_the_floor(real_data: Callable[[str], Path]) -> None:
    flight = np.load(real_data("ardrone_flight") / "flight.npz")
    watch, flown, suspected = FlowWatch(), flight["nav_altitude_mm"] > 0, 0
    for at_s, (forward, left, _) in zip(flight["nav_time_s"][flown], flight["nav_velocity_mm_s"][flown], strict=True):
        watch.update(round(at_s * 1e9), (forward / 1000, left / 1000), False)
        suspected += watch.suspected
        assert not watch.lost
    assert not suspected and flown.sum() > 8000
