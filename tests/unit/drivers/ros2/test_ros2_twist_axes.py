"""In whose axes a node states its velocity: judged by the way of its own position, and told to the operator."""

import math
from dataclasses import replace

import numpy as np
import pytest
from ros2_node import STANDING, Node

from drivers.ros2.twist_axes import TwistAxes
from groundstation.bus.messages import FlightState

SLOT_S = 0.05


class Flight:
    """A vehicle that flies at random, and the messages of its node: in_room, its twist is in the axes of the room."""

    def __init__(self, seed: int, yaw: float, in_room: bool, noise_m: float = 0.01) -> None:
        self.rng = np.random.default_rng(seed)
        self.place, self.yaw, self.in_room, self.noise_m = np.array([1.0, 2.0]), yaw, in_room, noise_m
        self.velocity = np.zeros(2)  # of the room
        self.aim = self.velocity

    def step(self, index: int) -> tuple[np.ndarray, np.ndarray]:
        """Return position and twist after the next slot."""
        if index % 40 == 0:
            self.aim = self.rng.uniform(-0.6, 0.6, 2)
        self.velocity = self.velocity + (self.aim - self.velocity) * 0.1
        self.place = self.place + self.velocity * SLOT_S
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        own = np.array([[c, s], [-s, c]]) @ self.velocity
        twist = (self.velocity if self.in_room else own) + self.rng.normal(0.0, 0.05, 2)
        return self.place + self.rng.normal(0.0, self.noise_m, 2), twist


def wrong_after(flight: Flight, seconds: float) -> float | None:
    axes = TwistAxes()
    for index in range(round(seconds / SLOT_S)):
        (x, y), (vx, vy) = flight.step(index)
        axes.take(round(index * SLOT_S * 1e9) + 1, (x, y, 1.0), (vx, vy, 0.0), (vx, vy, 0.0), flight.yaw)
        if axes.wrong:
            return index * SLOT_S
    return None


@pytest.mark.parametrize("yaw", [0.7, -1.6, 3.1])
def test_a_twist_in_the_axes_of_the_room_is_recognised_within_two_metres(yaw: float) -> None:
    after = [wrong_after(Flight(seed, yaw, in_room=True), 60.0) for seed in range(20)]
    assert None not in after and max(one for one in after if one is not None) < 10.0


@pytest.mark.parametrize("yaw", [0.0, 0.7, -1.6, 3.1])
@pytest.mark.parametrize("noise_m", [0.01, 0.05])
def test_a_twist_in_its_own_axes_never_counts_as_wrong(yaw: float, noise_m: float) -> None:
    assert {wrong_after(Flight(seed, yaw, in_room=False, noise_m=noise_m), 120.0) for seed in range(20)} == {None}


def test_near_the_rooms_heading_both_readings_agree() -> None:
    assert {wrong_after(Flight(seed, 0.2, in_room=True), 120.0) for seed in range(10)} == {None}


@pytest.mark.parametrize("jump_m", [0.5, 5.0])
def test_a_position_that_jumps_drifts_or_stands_accuses_no_twist(jump_m: float) -> None:
    axes, rng = TwistAxes(), np.random.default_rng(1)
    for index in range(2400):
        x = jump_m * (index // 40 % 2) if index < 1600 else 0.02 * index  # jumps, then a drift of 0.4 m/s
        vx, vy = rng.normal(0.0, 0.05, 2)
        axes.take(1 + round(index * SLOT_S * 1e9), (x, 0.0, 1.0), (vx, vy, 0.0), (vx, vy, 0.0), 1.5)
    assert not axes.wrong


def test_the_vehicle_lands_with_the_reason_its_landing_is_seen_and_a_mended_node_is_believed(node: Node) -> None:
    node.say(STANDING)
    flight = Flight(1, math.pi / 2, in_room=True)
    for index in range(400):
        (x, y), (vx, vy) = flight.step(index)
        half, sway = math.pi / 4, 0.01 * math.sin(index)  # an attitude that never changes would be stuck
        turned = (sway * math.cos(half), sway * math.sin(half), math.sin(half), math.cos(half))
        told = replace(STANDING, position=(x, y, 0.8), quaternion=turned, velocity=(vx, vy, 0.0))
        view = node.say(told)
        if view.unsound:
            break
    assert "moves as if its twist were in the axes of the room" in view.unsound and index > 40
    node.heard.drain()
    for _ in range(40):
        view = node.say(replace(STANDING, quaternion=turned))
    assert view.flight_state is FlightState.LANDED and view.unsound and not node.heard.drain()
    node.say(STANDING, publisher=b"mended-publisher", after_ms=2000)
    view = node.say(STANDING, publisher=b"mended-publisher")
    assert view.fresh and not view.unsound and node.heard.drain()
