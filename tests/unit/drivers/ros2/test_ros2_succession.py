"""Two publishers of one vehicle's odometry: an heir counts on the floor, and in flight only if it continues."""

import math
from dataclasses import replace

import pytest
from ros2_node import STANDING, FakeLink, Node

from drivers.rmw_zenoh.wire import graph, vehicle
from drivers.watchdog_types import Action, DriverMode, WatchdogDecision
from groundstation.bus.messages import FlightState

FIRST, HEIR = b"publisher-of-it.", b"another-publishe"
FLYING = replace(STANDING, position=(1.0, 2.0, 0.8), velocity=(0.1, 0.0, 0.0))


def fly(node: Node, height_m: float = 0.8) -> None:
    node.driver.apply(node.now_ns, WatchdogDecision(DriverMode.HOVER, Action.HOVER))
    for number in range(20):
        swing = 0.01 * math.sin(number)
        node.say(replace(FLYING, position=(1.0, 2.0, height_m), velocity=(0.1 + swing, swing, 0.0)))
    node.heard.drain()


def turned(degrees: float) -> vehicle.Quaternion:
    return (0.0, 0.0, math.sin(math.radians(degrees) / 2), math.cos(math.radians(degrees) / 2))


@pytest.mark.parametrize(
    ("heir", "frames", "after_ms", "why"),
    [
        (replace(FLYING, position=(1.0, 2.0, 0.0)), ("odom", "base_link"), 1500, "it says that it stands"),
        (replace(FLYING, position=(0.0, 2.0, 0.8)), ("odom", "base_link"), 1500, "1.0 m away"),
        (replace(FLYING, position=(1.0, 2.0, 1.3)), ("odom", "base_link"), 1500, "0.5 m higher"),
        (replace(FLYING, position=(1.0, 2.0, 0.4)), ("odom", "base_link"), 1500, "0.4 m lower"),
        (replace(FLYING, quaternion=turned(-90.0)), ("odom", "base_link"), 1500, "turned by 90 deg"),
        (FLYING, ("map", "base_link"), 1500, "in frame 'map' of 'base_link', not frame 'odom' of 'base_link'"),
        (FLYING, ("odom", "drone_2"), 1500, "in frame 'odom' of 'drone_2', not frame 'odom' of 'base_link'"),
        (FLYING, ("odom", "base_link"), 4000, "4 s after the last one"),
    ],
)
def test_in_flight_an_heir_that_does_not_continue_is_silence(
    node: Node, heir: vehicle.OdometryMessage, frames: tuple[str, str], after_ms: int, why: str
) -> None:
    fly(node)
    for number in range(40):
        view = node.say(
            heir, frame=frames[0], own_frame=frames[1], publisher=HEIR, after_ms=after_ms if not number else 50
        )
        assert not view.fresh and view.flight_state in (FlightState.HOVERING, FlightState.FLYING)
    assert view.silence == (
        "its sensors cannot be believed: its odometry (/drone_1/odom of /drone_1/driver) "
        f"is refused: another publisher took over in flight, {why}"
    )
    assert node.rejected == {"heir_in_flight": 40} and not node.heard.drain()
    assert node.say(FLYING).fresh, "the first one speaks again"


@pytest.mark.parametrize("height_m", [0.8, 0.5])
def test_an_heir_that_continues_the_flight_is_believed(node: Node, height_m: float) -> None:
    fly(node, height_m)
    heir = replace(FLYING, position=(1.4, 2.3, height_m - 0.1), quaternion=turned(20.0))
    assert node.say(heir, publisher=HEIR, after_ms=1200).fresh
    assert node.say(heir, publisher=HEIR).fresh and node.rejected == {}
    assert node.say(FLYING).fresh, "it is now the second one"
    assert node.rejected == {"second_publisher": 1}


def test_of_a_node_that_was_restarted_within_a_second_nobody_is_told_to_end_it(node: Node) -> None:
    node.say(STANDING)
    assert "two publishers" in node.say(STANDING, publisher=HEIR).not_ready
    for _ in range(25):
        view = node.say(STANDING, publisher=HEIR)
    assert view.fresh and "two publishers" not in view.not_ready, "the first one has ended"


def test_on_the_floor_an_heir_is_taken(node: Node) -> None:
    for _ in range(20):
        node.say(STANDING)
    node.driver.apply(node.now_ns, WatchdogDecision(DriverMode.LANDED, Action.IDLE))
    moved = replace(STANDING, position=(7.0, -2.0, 0.1), quaternion=turned(120.0))
    view = node.say(moved, frame="map", publisher=HEIR, after_ms=1100)
    assert view.fresh and view.flight_state is FlightState.LANDED and node.rejected == {}


def test_no_heir_during_a_take_off_that_has_not_risen_yet(node: Node) -> None:
    for _ in range(20):
        node.say(STANDING)
    node.driver.apply(node.now_ns, WatchdogDecision(DriverMode.TAKING_OFF, Action.TAKE_OFF))
    assert not node.say(STANDING, publisher=HEIR, after_ms=1100).fresh


def test_two_at_once_are_told_the_first_is_kept_and_nobody_takes_off(node: Node) -> None:
    node.say(STANDING)
    view = node.say(replace(FLYING, position=(0.0, 0.0, 2.0)), publisher=HEIR)
    assert view.fresh and view.flight_state is FlightState.LANDED and node.rejected == {"second_publisher": 1}
    assert view.not_ready == (
        "its odometry (/drone_1/odom of /drone_1/driver) has two publishers, "
        "of which the first counts: end the other one"
    )
    for _ in range(70):
        view = node.say(STANDING)
    assert view.not_ready == "", "the other one has ended"


def test_two_at_once_are_told_in_flight(node: Node) -> None:
    node.say(STANDING)
    node.driver.apply(node.now_ns, WatchdogDecision(DriverMode.TAKING_OFF, Action.TAKE_OFF))
    fly(node)
    node.say(FLYING, publisher=HEIR)
    node.say(FLYING)
    assert "has two publishers, of which the first counts" in node.driver.health(node.now_ns).detail
    link = node.driver._link
    assert isinstance(link, FakeLink)
    link.odometry_nodes = ()
    assert node.driver.health(node.now_ns).detail.startswith("its odometry (/drone_1/odom) has two publishers")


def test_nodes_are_named_by_the_tokens_of_their_publishers() -> None:
    kind, hashed = vehicle.ODOMETRY, "RIHS01_x"
    token = graph.publisher_token(5, "abc", "skein", 3, "/drone_1/odom", kind, hashed)
    assert graph.node_of(token) == "/skein"
    other = token.replace("/%/%/skein/", "/%/%fleet%one/driver/")
    assert graph.node_of(other) == "/fleet/one/driver"
    assert graph.node_of("@ros2_lv/5/abc") == graph.node_of("5/drone_1/odom/a/b/c/d/e/f") == ""
    expression = "@ros2_lv/5/*/*/*/MP/*/*/*/%drone_1%odom/nav_msgs::msg::dds_::Odometry_/**"
    assert graph.publishers_key(5, "drone_1/odom", kind) == expression
