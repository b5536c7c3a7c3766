"""A vehicle behind a ROS 2 node that sends wrong messages: each is refused, with reason and remedy."""

import math
from dataclasses import replace

import pytest
from ros2_node import MS, STANDING, FakeLink, Node

from drivers.rmw_zenoh.wire import vehicle
from drivers.ros2.names import Order
from drivers.watchdog_types import Action, DriverMode, WatchdogDecision
from groundstation.bus.messages import FlightState, Odometry

ON_ITS_BACK = (1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        (replace(STANDING, velocity=(0.0, 1.7e308, -1.7e308), quaternion=(0.6, 0.0, 0.0, 0.8)), "absurd"),
        (replace(STANDING, velocity=(1e4, 0.0, 0.0)), "absurd"),
        (replace(STANDING, position=(0.0, 0.0, 1e308)), "absurd"),
        (replace(STANDING, turn=(0.0, 0.0, -1e300)), "absurd"),
        (replace(STANDING, quaternion=(0.0, 0.0, 0.0, 0.0)), "no rotation"),
        (replace(STANDING, position=(0.0, 0.0, math.inf)), "no number"),
    ],
)
def test_invalid_odometry_is_refused_with_a_reason(node: Node, wrong: vehicle.OdometryMessage, reason: str) -> None:
    for _ in range(20):
        view = node.say(wrong)
    assert not view.fresh and view.flight_state is FlightState.UNKNOWN
    assert view.silence.endswith(f"its odometry (/drone_1/odom of /drone_1/driver) is refused: {reason}")
    assert node.rejected == {reason.replace(" ", "_"): 20} and not node.heard.drain()
    view = node.say(STANDING)
    assert view.fresh and not view.unsound and all(map(math.isfinite, view.velocity_m_s or ()))


def test_in_flight_what_is_refused_counts_as_silence_with_its_reason(node: Node) -> None:
    node.say(STANDING)
    for _ in range(7):
        view = node.say(replace(STANDING, velocity=(1e9, 0.0, 0.0)))
    assert not view.fresh and "is refused: absurd" in view.unsound


def test_a_twist_in_the_axes_of_the_room_is_no_twist_of_the_vehicle(node: Node) -> None:
    view = node.say(STANDING, frame="odom", own_frame="odom")
    assert not view.fresh and "twist in the axes of the room" in view.unsound
    assert node.say(STANDING, frame="", own_frame="").fresh  # without a name, the usual frame may be meant


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (replace(STANDING, position=(0.0, 0.0, -0.75)), "z = -0.75 m where it stands: set ros2.standing_z_m"),
        (replace(STANDING, quaternion=ON_ITS_BACK), "stands tilted by 180 deg: its axes must be x ahead"),
        (replace(STANDING, velocity=(3.0, 0.0, 0.0)), "3.0 m/s where it stands"),
    ],
)
def test_impossible_odometry_of_a_standing_vehicle_prevents_take_off(
    node: Node, wrong: vehicle.OdometryMessage, words: str
) -> None:
    assert node.say(STANDING).not_ready == ""
    view = node.say(wrong)
    assert view.flight_state is FlightState.LANDED and words in view.not_ready and view.configured
    assert node.say(STANDING).not_ready == ""


def test_a_vehicle_that_seems_to_fly_and_was_never_told_to_names_the_setting(node: Node) -> None:
    node.say(replace(STANDING, position=(4.0, 2.0, 0.42)))
    assert "z = 0.42 m: if it stands, set ros2.standing_z_m" in node.driver.health(node.now_ns).detail
    node.driver.apply(node.now_ns, WatchdogDecision(DriverMode.TAKING_OFF, Action.TAKE_OFF))
    assert node.driver.health(node.now_ns).detail == ""


def test_land_is_repeated_for_five_seconds_after_a_landing_seems_to_be_over(node: Node) -> None:
    """Its height may be wrong: LANDED may be said of a vehicle that still descends."""
    link = node.driver._link
    assert isinstance(link, FakeLink)
    node.say(STANDING)
    node.driver.apply(node.now_ns, WatchdogDecision(DriverMode.LANDING, Action.LAND))
    at_s = []
    for turn in range(200):
        before = len(link.ordered)
        node.now_ns += 50 * MS
        node.driver.apply(node.now_ns, WatchdogDecision(DriverMode.LANDED, Action.IDLE))
        at_s += [0.05 * (turn + 1)] * (len(link.ordered) - before)
    assert set(link.ordered) == {str(Order.LAND)}
    assert 4.4 < max(at_s) < 5.0 and len(at_s) == 10


@pytest.mark.parametrize(("height_m", "least", "most"), [(0.8, 39, 40), (0.0, 2, 3)])
def test_with_its_motors_cut_it_is_told_to_stand_still(node: Node, height_m: float, least: int, most: int) -> None:
    """A node without such an order, or that refuses it, would fly on at its last velocity."""
    link = node.driver._link
    assert isinstance(link, FakeLink)
    node.say(replace(STANDING, position=(0.0, 0.0, height_m)))
    node.driver.apply(node.now_ns, WatchdogDecision(DriverMode.TRACK, Action.FLY, (0.5, 0.0, 0.0)))
    link.flown.clear()
    for _ in range(40):
        node.now_ns += 50 * MS
        node.driver.apply(node.now_ns, WatchdogDecision(DriverMode.CUT, Action.CUT))
    assert set(link.flown) == {(0.0, 0.0, 0.0)} and least <= len(link.flown) <= most
    assert str(Order.CUT) in link.ordered


def test_one_absurd_velocity_is_not_published_and_the_next_ones_are_uncertain(node: Node) -> None:
    flying = replace(STANDING, position=(0.0, 0.0, 1.0))

    def moves(number: int, forward: float = 0.0) -> vehicle.OdometryMessage:
        swing = 0.01 * math.sin(number)
        return replace(flying, quaternion=(swing, 0.0, 0.0, 1.0), velocity=(swing + forward, swing, 0.0))

    for number in range(20):
        node.say(moves(number))
    node.heard.drain()
    for number, forward in ((20, 99.0), (21, 0.0), (22, 0.0)):
        node.say(moves(number, forward))
    told = [one.message for one in node.heard.drain() if isinstance(one.message, Odometry)]
    assert [one.velocity_m_s[0] < 1.0 for one in told] == [True, True]
    assert all(one.velocity_covariance[0] == pytest.approx(0.25) for one in told)


def test_a_second_publisher_of_the_charge_is_counted_until_the_first_is_silent_for_long(node: Node) -> None:
    def charge(told: float, publisher: bytes, seconds: int = 2) -> float | None:
        node.now_ns += seconds * 1000 * MS
        payload = vehicle.encode_battery(node.now_ns, told)
        node.driver._hear("0/drone_1/battery/sensor_msgs::msg::dds_::BatteryState_/RIHS01_x", payload, publisher)
        return node.driver.view(node.now_ns).battery

    assert charge(0.8, b"the vehicle's own") == pytest.approx(0.8)
    assert charge(1.0, b"that of another..") == charge(0.8, b"the vehicle's own") == pytest.approx(0.8)
    assert node.rejected == {"second_battery_publisher": 1}
    assert charge(0.5, b"that of another..", 31) == pytest.approx(0.5), "the node was restarted"
