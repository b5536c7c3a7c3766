"""The ROS 2 bridge on a ROS-like Zenoh router: a foreign client lists the topics and decodes them."""

import time
from collections.abc import Iterator
from typing import Any

import pytest
import zenoh
from free_port import free_port
from zenoh_peer import opened

pytest.importorskip("rosbags")

from drivers.rmw_zenoh.session import RouterSession
from groundstation.bus import clock
from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.engineering_views.ros2.codec import Ros2Codec
from groundstation.engineering_views.ros2.live import Ros2View
from groundstation.errors import OperatorMistake
from groundstation.recording.timeline import Timeline
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field


@pytest.fixture
def router() -> Iterator[str]:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    session = opened(mode="router", listen={"endpoints": [endpoint]})
    yield endpoint
    session.close()


def test_a_foreign_client_lists_and_decodes(router: str) -> None:
    exchange = MemoryExchange()
    tracker, watcher = MemoryBus(exchange, "lab", "tracker"), MemoryBus(exchange, "lab", "view")
    queue = watcher.subscribe([t.ESTIMATE, t.EVENT])
    foreign = opened(mode="client", connect={"endpoints": [router]})
    heard: dict[str, list[Any]] = {}
    listening = foreign.declare_subscriber(
        "7/**", lambda sample: heard.setdefault(str(sample.key_expr), []).append(sample)
    )
    bridge = Ros2View(router, 7, "jazzy", None, Timeline(clock.clock_id(), clock.unix_offset_ns()))
    robot = m.EntityEstimate("drone_1", "robot", (1.0, 2.0, 1.5, 0.0), (0.01,) * 16, (0.0, 0.0, 0.0), True, 0.0)
    try:
        for _ in range(3):
            tracker.publish(t.ESTIMATE, m.Estimate(header=tracker.header("team"), entities=(robot,), epoch=1))
            for sample in queue.drain_samples():
                bridge.take(sample, clock.now_ns())
        deadline = time.monotonic() + 5
        while len(heard) < 4 and time.monotonic() < deadline:
            time.sleep(0.02)
        tokens = [str(reply.ok.key_expr) for reply in foreign.liveliness().get("@ros2_lv/7/**") if reply.ok]
        assert any("/NN/" in token for token in tokens)
        assert any("/MP/" in token and "%skein%drone_1%pose" in token for token in tokens)
        codec, kind = Ros2Codec(), "geometry_msgs/msg/PoseWithCovarianceStamped"
        key = f"7/skein/drone_1/pose/geometry_msgs::msg::dds_::PoseWithCovarianceStamped_/{codec.hash_of(kind)}"
        pose: Any = codec.store.deserialize_cdr(heard[key][-1].payload.to_bytes(), kind)
        assert (pose.pose.pose.position.x, pose.pose.pose.position.y) == (1.0, 2.0)
        assert len(heard[key][-1].attachment.to_bytes()) == 33
    finally:
        bridge.close()
        listening.undeclare()
        foreign.close()


def test_topics_of_a_field_are_listed_before_their_first_message(router: str) -> None:
    field = resolved_field(load_field(find_field("lab")))
    foreign = opened(mode="client", connect={"endpoints": [router]})
    bridge = Ros2View(router, 7, "jazzy", field, Timeline(clock.clock_id(), clock.unix_offset_ns()))
    wanted = {"tf", "tf_static", "rosout", "diagnostics"}
    wanted |= {f"skein%{name}" for name in ("markers", "turtlebot%odom", "ceiling%camera_info")}
    wanted |= {f"skein%drone_{n}%{what}" for n in (1, 2) for what in ("pose", "odom", "setpoint", "battery")}
    try:
        listed, deadline = set[str](), time.monotonic() + 5
        while not wanted <= listed and time.monotonic() < deadline:
            tokens = [str(reply.ok.key_expr) for reply in foreign.liveliness().get("@ros2_lv/7/**") if reply.ok]
            listed = {token.split("/")[-4].removeprefix("%") for token in tokens if "/MP/" in token}
        assert wanted <= listed
        assert not {name for name in listed if "truth" in name}
    finally:
        bridge.close()
        foreign.close()


@pytest.mark.parametrize("truth", [False, True])
def test_true_states_come_where_they_are_asked_for(router: str, truth: bool) -> None:
    exchange = MemoryExchange()
    simulator, watcher = MemoryBus(exchange, "lab", "sim_bridge"), MemoryBus(exchange, "lab", "view")
    bridge = Ros2View(router, 7, "jazzy", None, Timeline(clock.clock_id(), clock.unix_offset_ns()), truth)
    try:
        queues = bridge.subscribe(watcher)
        state = m.TruthState(
            header=simulator.header("drone_1"), position_m=(0, 0, 1), velocity_m_s=(0, 0, 0), attitude_rad=(0, 0, 0),
            on_ground=False,
        )  # fmt: skip
        simulator.publish(t.TRUTH, state)
        assert sum(len(queue.drain_samples()) for queue in queues) == truth
    finally:
        bridge.close()


def test_a_router_that_goes_while_it_is_joined_is_joined_again(router: str) -> None:
    failures = [zenoh.ZError("the transport is closed")]

    def joined(_session: RouterSession) -> None:
        if failures:
            raise failures.pop()

    session = RouterSession(router, [], lambda _key, _payload, _publisher: None, joined)
    try:
        deadline = time.monotonic() + 10
        while not session.is_open and time.monotonic() < deadline:
            time.sleep(0.02)
        assert session.reaches_router and not failures
    finally:
        session.close()


def test_a_missing_router_is_named_with_the_remedy() -> None:
    timeline = Timeline(clock.clock_id(), clock.unix_offset_ns())
    with pytest.raises(OperatorMistake, match="no ROS 2 Zenoh router answers"):
        Ros2View(f"tcp/127.0.0.1:{free_port()}", 0, "jazzy", None, timeline)
