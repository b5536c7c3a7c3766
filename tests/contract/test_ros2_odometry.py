"""A target's nav_msgs/Odometry from a foreign encoder, through a ROS-like router, becomes reports."""

import time
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from free_port import free_port
from stream_child import StreamChild
from zenoh_peer import opened

pytest.importorskip("rosbags")

from drivers.rmw_zenoh.wire import graph, vehicle
from drivers.target_odometry.driver import OdometryDriver, OdometryGuard
from drivers.target_odometry.settings import OdometrySection, emulated_source, parse_source
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import CameraStatus, ReportedMotion
from groundstation.bus.topics import CAMERA_STATUS, REPORTED_MOTION
from groundstation.engineering_views.ros2.codec import Ros2Codec
from sim_bridge.devices.odometry_router import OdometryRouter
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.wheel_odometry import WheelOdometry

KIND, HOST, MS = "nav_msgs/msg/Odometry", "127.0.0.1", 1_000_000
MOVING = vehicle.OdometryMessage(5_000_000_006, (1.0, 2.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.3, 0.0, 0.0), (0.0, 0.0, 0.5))


class Rig:
    """The driver, a subscriber, and a way to run it until a condition holds."""

    def __init__(self, port: int) -> None:
        exchange = MemoryExchange()
        self.heard = MemoryBus(exchange, "lab", "ears").subscribe([REPORTED_MOTION, CAMERA_STATUS])
        self.child = StreamChild(MemoryBus(exchange, "lab", "cart_odometry"), "cart_odometry")
        source = f"ros2://{HOST}:{port}/cart/odom?domain=7"
        section = OdometrySection(
            name="cart_odometry",
            target="cart",
            source=source,
            max_speed_m_s=0.7,
            start_within_s=0.5,
            silent_after_s=0.4,
        )
        self.driver = OdometryDriver(self.child, section)  # type: ignore[arg-type]
        self.reports, self.status = list[ReportedMotion](), list[CameraStatus]()

    def until(self, true: Any, put: Any = lambda: None) -> None:
        deadline = time.monotonic() + 15.0
        while not true():
            assert time.monotonic() < deadline, (self.child.told, self.driver.counts)
            put()
            self.driver.turn()
            messages = [one.message for one in self.heard.drain()]
            self.reports += [one for one in messages if isinstance(one, ReportedMotion)]
            self.status += [one for one in messages if isinstance(one, CameraStatus)]


@pytest.fixture
def port() -> int:
    return free_port(HOST)


@pytest.fixture
def rig(port: int) -> Iterator[Rig]:
    rig = Rig(port)
    yield rig
    rig.driver.close()


def written(codec: Ros2Codec, stamp_ns: int, forward: float, left: float, x: float) -> bytes:
    """Return an Odometry as rosbags writes it."""
    store: Any = codec.store
    types = store.types
    at = types["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 10**9))
    point, turned = types["geometry_msgs/msg/Point"](x, 2.0, 0.0), types["geometry_msgs/msg/Quaternion"](0, 0, 0.6, 0.8)
    vector, unknown = types["geometry_msgs/msg/Vector3"], np.zeros(36)
    pose = types["geometry_msgs/msg/PoseWithCovariance"](types["geometry_msgs/msg/Pose"](point, turned), unknown)
    twist = types["geometry_msgs/msg/Twist"](vector(forward, left, 0.0), vector(0.0, 0.0, 0.5))
    motion = types["geometry_msgs/msg/TwistWithCovariance"](twist, unknown)
    header = types["std_msgs/msg/Header"](at, "odom")
    return bytes(store.serialize_cdr(types[KIND](header, "base_footprint", pose, motion), KIND))


def test_a_strangers_odometry_comes_as_reports_and_its_silence_is_told(rig: Rig, port: int) -> None:
    rig.until(lambda: any("DEGRADED" in one for one in rig.child.told))
    assert "no ROS 2 Zenoh router answers" in rig.child.told[0]
    router = opened(mode="router", listen={"endpoints": [f"tcp/{HOST}:{port}"]})
    node = opened(mode="client", connect={"endpoints": [f"tcp/{HOST}:{port}"]})
    codec, count = Ros2Codec(), iter(range(10**6))
    key = graph.topic_key(7, "/cart/odom", KIND, codec.hash_of(KIND))

    def put() -> None:
        number = next(count)
        node.put(key, written(codec, time.time_ns(), 0.25, -0.125, 0.01 * number))
        node.put(key.replace("Odometry_", "Path_"), b"of another type")

    try:
        rig.until(lambda: len(rig.reports) >= 3, put)
        report = rig.reports[-1]
        assert (report.header.entity, report.velocity_m_s, report.std_m_s) == ("cart", (0.25, -0.125), 0.05)
        gaps = np.diff([one.header.stamp_ns for one in rig.reports])
        assert min(gaps) >= 45 * MS and rig.child.told[-2] == "READY"
        node.put(key, b"cut short")
        rig.until(lambda: rig.driver.counts["encapsulation"] + rig.driver.counts["short"] > 0)
        rig.until(lambda: "DEGRADED" in rig.child.told[-2])
        assert "cameras track the target meanwhile" in rig.child.told[-1]
        rig.until(lambda: rig.status and not rig.status[-1].connected)
    finally:
        node.close()
        router.close()


def test_the_emulated_turtlebot_speaks_as_a_stranger_would(rig: Rig, port: int) -> None:
    base: Any = SimpleNamespace(wheels=(0.3, -0.2))
    wheels = WheelOdometry(base, False, np.random.default_rng(1))
    router = OdometryRouter("cart_odometry", (HOST, port), rig.driver._settings.source, wheels)

    def tick() -> None:
        time.sleep(0.005)
        router.send()

    try:
        rig.until(lambda: len(rig.reports) >= 5, tick)
        assert all(abs(one.velocity_m_s[0] - 0.3) < 0.005 for one in rig.reports) and not rig.driver.counts
        router.silent = True
        rig.until(lambda: any("DEGRADED no report for 0.4 s" in one for one in rig.child.told), router.send)
    finally:
        router.close()


@pytest.mark.parametrize(
    ("kind", "told"),
    [("odometry_silent", "no report for 0.4 s"), ("odometry_frozen", "hangs"), ("odometry_scaled", "")],
)
def test_a_scenario_breaks_the_emulated_odometry(rig: Rig, port: int, kind: str, told: str) -> None:
    base: Any = SimpleNamespace(wheels=(0.4, -0.2))
    wheels = WheelOdometry(base, False, np.random.default_rng(1))
    fault = Fault(kind=FaultKind(kind), entity="cart", start_s=0.5)
    router = OdometryRouter("cart_odometry", (HOST, port), rig.driver._settings.source, wheels, [fault])

    def tick() -> None:
        time.sleep(0.005)
        router.send()

    try:
        rig.until(lambda: rig.child.told[-2:-1] == ["READY"], tick)
        if told:
            rig.until(lambda: "DEGRADED" in rig.child.told[-2] and told in rig.child.told[-2], tick)
        else:
            rig.until(lambda: abs(rig.reports[-1].velocity_m_s[0] - 0.2) < 0.005, tick)
        assert any(abs(one.velocity_m_s[0] - 0.4) < 0.005 for one in rig.reports), "it was sound before"
    finally:
        router.close()


class Says:
    """A guard, and a node that publishes 50 times a second on another clock."""

    def __init__(self) -> None:
        self.guard, self.now, self.step = OdometryGuard(1.05), 10**12, 0

    def next(self, age_ms: float = 0.0, publisher: bytes = b"a", **changes: Any) -> str:
        self.step += 1
        self.now += 20 * MS
        where = (0.006 * self.step, 0.0, 0.0)
        told = replace(MOVING, stamp_ns=self.now - 7 * 10**11 - round(age_ms * MS), position=where)
        return self.guard.refusal(self.now, replace(told, **changes), publisher)


def test_a_sound_one_is_used() -> None:
    says = Says()
    assert {says.next() for _ in range(100)} == {""}


def test_one_that_hangs_is_refused_whatever_its_stamps_say() -> None:
    says = Says()
    assert [says.next(position=(1.0, 0.0, 0.0)) for _ in range(20)][-4:] == ["hangs"] * 4
    assert says.next() == ""
    assert [says.next(stamp_ns=3 * 10**11) for _ in range(20)][-4:] == ["hangs"] * 4


def test_one_whose_node_leaves_stamps_out_is_used() -> None:
    says = Says()
    assert {says.next(stamp_ns=0) for _ in range(100)} == {""}


def test_one_that_stands_may_repeat_itself() -> None:
    says = Says()
    still: dict[str, Any] = {"position": (0.0, 0.0, 0.0), "velocity": (0.0, 0.0, 0.0), "turn": (0.0, 0.0, 0.0)}
    assert {says.next(**still) for _ in range(100)} == {""}


def test_late_or_impossibly_fast_odometry_is_refused() -> None:
    says = Says()
    assert {says.next() for _ in range(20)} == {""}
    assert says.next(age_ms=400) == "late" and says.next() == ""
    assert says.next(age_ms=200) == "" and says.guard.late_s == pytest.approx(0.2, abs=1e-3)
    assert {says.next(age_ms=2000) for _ in range(2000)} == {"late"} and says.next() == ""
    assert says.next(velocity=(1.2, 0.0, 0.0)) == "too fast"


def test_a_second_publisher_is_refused_while_the_first_one_speaks() -> None:
    says = Says()
    assert [says.next(), says.next(publisher=b"b"), says.next()] == ["", "second publisher", ""]
    says.now += 2000 * MS
    assert says.next(publisher=b"b") == ""


def test_the_address_names_router_topic_and_domain() -> None:
    address = parse_source("ros2://10.0.0.2/robot/odom?domain=5")
    assert (address.host, address.port, address.topic, address.domain) == ("10.0.0.2", 7447, "robot/odom", 5)
    assert emulated_source("ros2://10.0.0.2/odom?domain=5", "127.1.2.3", 8080) == "ros2://127.1.2.3:8080/odom?domain=5"
    for wrong in ("ros2://10.0.0.2", "ros2:///odom", "http://10.0.0.2/odom", "ros2://h/odom?domain=900", "odom"):
        with pytest.raises(ValueError, match=r"ros2://|domain"):
            parse_source(wrong)
