"""Driver, failsafe sender and emulator of a vehicle behind a ROS 2 node, through a router on loopback."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from free_port import free_port

from drivers.rmw_zenoh.wire import graph, vehicle
from drivers.ros2.driver import Ros2Vehicle
from drivers.ros2.failsafe_transport import Ros2Failsafe
from drivers.ros2.names import HOVER, LAND
from drivers.ros2.settings import Ros2DriverSettings, Ros2Section
from drivers.watchdog_types import Action, DriverMode, WatchdogDecision
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import FlightState
from groundstation.bus.topics import ODOMETRY, RAW_RX, RAW_TX
from groundstation.errors import GroundStationError
from sim_bridge.devices.ros2 import Ros2Emulator
from sim_bridge.devices.tello import TelloBody
from sim_bridge.scenario import Scenario
from sim_bridge.site import SiteDrone
from sim_bridge.world.noise import generator_of

ADDRESS = "127.64.91.11"
# Not a limit to be tested: a busy machine may be slow.
_PATIENCE_S = 30.0
DRONE = SiteDrone.model_validate(
    {"kind": "ros2", "pad_m": (0.0, 0.0), "pad_yaw_deg": 30.0, "marker": {"code": 1, "position_m": (0.0, 0.0, 0.08)}}
)


class Room:
    """An emulated vehicle whose time advances by calls, and its driver without a loop."""

    def __init__(self, **own: Any) -> None:
        self.section = Ros2Section(port=free_port(ADDRESS), namespace="drone_1", domain=3, **own)
        self.settings = Ros2DriverSettings(name="drone_1", address=ADDRESS, pad_m=(0.0, 0.0), ros2=self.section)
        self.body = TelloBody(DRONE, Scenario(), 0.005, generator_of(1, "ros2"))
        self.node = Ros2Emulator("drone_1", ADDRESS, self.section.model_dump(), self.body)
        exchange = MemoryExchange()
        self.heard = MemoryBus(exchange, "lab", "view").subscribe([ODOMETRY, RAW_RX, RAW_TX])
        self.driver = Ros2Vehicle(self.settings, MemoryBus(exchange, "lab", "drone_1"))

    def until(self, condition: Callable[[], bool], action: Action = Action.IDLE, velocity=(0.0, 0.0, 0.0)) -> None:
        """Advance time, with an action sent to the driver twenty times a second, until a condition holds."""
        deadline = time.monotonic() + _PATIENCE_S
        tick = 0
        while not condition():
            assert time.monotonic() < deadline, (self.driver.view(time.monotonic_ns()), self.body.airframe.z)
            self.turn()
            if tick % 10 == 0:
                time.sleep(0.002)  # the network's threads
                self.driver.apply(time.monotonic_ns(), WatchdogDecision(DriverMode.TRACK, action, velocity, 0.0))
            tick += 1

    def turn(self) -> None:
        self.node.receive()
        self.body.step((0.0, 0.0, 0.0))
        self.body.sense()
        self.node.send()

    @property
    def state(self) -> FlightState:
        return self.driver.view(time.monotonic_ns()).flight_state

    def ready(self) -> bool:
        view = self.driver.view(time.monotonic_ns())
        return view.configured and view.fresh and view.battery is not None

    def close(self) -> None:
        self.driver.close()
        self.node.close()


@pytest.fixture(params=[{}, {"orders": "services", "velocity_type": "twist_stamped", "distro": "humble"}])
def room(request: pytest.FixtureRequest) -> Iterator[Room]:
    room = Room(**request.param)
    yield room
    room.close()


def test_it_flies_by_topics_and_by_services(room: Room) -> None:
    room.until(room.ready)
    assert room.state is FlightState.LANDED
    room.until(lambda: room.state is FlightState.FLYING, Action.TAKE_OFF)
    room.until(lambda: room.body.airframe.vx > 0.2, Action.FLY, (3.0, 0.0, 0.0))  # of which 0.6 is allowed
    forward, _ = room.body.airframe.velocity_stabilized()
    assert 0.2 < forward < 0.8
    room.until(lambda: not room.body.motors_on, Action.CUT)
    room.until(lambda: room.state is FlightState.LANDED, Action.CUT)
    room.driver.flush()
    topics = {received.key.topic for received in room.heard.drain()}
    assert topics == {ODOMETRY, RAW_RX, RAW_TX}


def test_a_take_off_that_is_called_off_is_followed_by_land() -> None:
    room = Room()
    try:
        room.until(room.ready)
        room.until(lambda: room.body.motors_on, Action.TAKE_OFF)
        assert room.state is FlightState.LANDED, "it has not risen yet"
        room.until(lambda: not room.body.motors_on, Action.IDLE)
        assert room.body.airframe.z < 0.3
    finally:
        room.close()


def test_the_transport_of_a_dead_driver_stops_and_lands_it() -> None:
    room = Room()
    transport = Ros2Failsafe(room.settings.model_dump_json(), 3)
    try:
        room.until(room.ready)
        room.until(lambda: room.state is FlightState.FLYING, Action.TAKE_OFF)
        room.until(lambda: room.body.airframe.vx > 0.2, Action.FLY, (0.6, 0.0, 0.0))
        for _ in range(60):
            transport.send(HOVER, ())
            for _ in range(10):
                room.turn()
            time.sleep(0.001)
        assert room.body.wanted[0] == (0.0, 0.0, 0.0)
        assert room.body.airframe.velocity_stabilized()[0] < 0.15
        deadline = time.monotonic() + _PATIENCE_S
        while room.body.motors_on and time.monotonic() < deadline:
            transport.send(LAND, ())
            room.turn()
            time.sleep(0.0005)
        assert not room.body.motors_on
    finally:
        transport.close()
        room.close()


def test_a_transport_without_a_router_says_so() -> None:
    settings = Ros2DriverSettings(
        name="drone_1", address=ADDRESS, pad_m=(0.0, 0.0), ros2=Ros2Section(port=free_port(ADDRESS))
    )
    transport = Ros2Failsafe(settings.model_dump_json(), 2)
    try:
        for word in (HOVER, LAND):
            with pytest.raises(OSError, match="no ROS 2 Zenoh router"):
                transport.send(word, ())
    finally:
        transport.close()


def test_a_missing_router_or_subscriber_is_named() -> None:
    room = Room(velocity_type="twist_stamped")
    port = room.section.port
    wrong = room.settings.model_copy(update={"ros2": Ros2Section(port=port, namespace="drone_1", domain=3)})
    driver = Ros2Vehicle(wrong, MemoryBus(MemoryExchange(), "lab", "drone_1"))
    try:
        assert driver.view(0).not_ready == f"no ROS 2 Zenoh router answers at tcp/{ADDRESS}:{port}"
        room.until(lambda: "router" not in driver.view(0).not_ready)
        assert driver.view(0).not_ready == "nobody in domain 3 takes geometry_msgs/msg/Twist from /drone_1/cmd_vel"
    finally:
        driver.close()
        room.close()
    with pytest.raises(GroundStationError, match="cannot listen on"):
        Ros2Emulator("drone_2", "203.0.113.1", {"port": 7447}, room.body)


def test_a_second_publisher_is_not_believed_and_what_is_no_message_is_counted() -> None:
    room = Room()
    try:
        room.until(room.ready)
        session = room.node._router.session
        key = graph.topic_key(3, "drone_1/odom", vehicle.ODOMETRY, "RIHS01_x")
        aloft = vehicle.OdometryMessage(9, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        stranger = graph.attachment(1, 9, b"another-publishe")
        rejected = lambda: room.driver.health(time.monotonic_ns()).rejected  # noqa: E731
        session.put(key, vehicle.encode_odometry(aloft, "odom", "x"), attachment=stranger)
        session.put(graph.topic_key(3, "drone_1/battery", vehicle.BATTERY, "RIHS01_x"), b"\0\1\0\0")
        room.until(lambda: {"second_publisher", "short"} <= set(rejected()))
        assert room.state is FlightState.LANDED
        token = graph.publisher_token(3, "abc", "old_driver", 3, "/drone_1/odom", vehicle.ODOMETRY, "RIHS01_x")
        announced = session.liveliness().declare_token(token)
        stray = graph.publisher_token(3, "abc", "other", 4, "/drone_2/odom", vehicle.ODOMETRY, "RIHS01_x")
        session.liveliness().declare_token(stray)
        not_ready = lambda: room.driver.view(time.monotonic_ns()).not_ready  # noqa: E731
        second = (key, vehicle.encode_odometry(aloft, "odom", "x"))

        def told(words: str) -> bool:
            session.put(*second, attachment=stranger)
            return words in not_ready()

        room.until(lambda: told("its odometry (/drone_1/odom of /old_driver) has two publishers"))
        announced.undeclare()
        room.until(lambda: told("its odometry (/drone_1/odom) has two publishers"))
    finally:
        room.close()
