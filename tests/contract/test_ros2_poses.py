"""ROS 2 poses from a foreign encoder, through a ROS-like router, arrive as motion capture frames."""

import math
import time
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any

import pytest
from free_port import free_port
from zenoh_peer import opened

pytest.importorskip("rosbags")

from drivers.motion_capture.captured_frame import CapturedFrame
from drivers.motion_capture.ros2_source import Ros2Source
from drivers.motion_capture.settings import parse_source
from drivers.motion_capture.sources import open_source
from drivers.motion_capture.wire.ros2_pose import UNKNOWN, body_of, decode_pose, encode_pose
from drivers.rmw_zenoh.wire import graph
from drivers.rmw_zenoh.wire.cdr import WireError
from groundstation.engineering_views.ros2.codec import Ros2Codec

PLACE, TURN = (1.0, -2.0, 1.5), (0.0, 0.0, 0.6, 0.8)
KINDS = ("geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/PoseWithCovarianceStamped", "nav_msgs/msg/Odometry")


def written(kind: str, frame: str, variances: Mapping[int, float] = MappingProxyType({})) -> bytes:
    """Return a pose as rosbags writes it; variances: entries of its covariance, the others 0."""
    store: Any = Ros2Codec().store
    types = store.types
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](5, 6), frame)
    pose = types["geometry_msgs/msg/Pose"](
        types["geometry_msgs/msg/Point"](*PLACE), types["geometry_msgs/msg/Quaternion"](*TURN)
    )
    import numpy as np

    covariance = np.zeros(36)
    for at, value in variances.items():
        covariance[at] = value
    sure = types["geometry_msgs/msg/PoseWithCovariance"](pose, covariance)
    zero = types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
    twist = types["geometry_msgs/msg/TwistWithCovariance"](types["geometry_msgs/msg/Twist"](zero, zero), np.zeros(36))
    values = {KINDS[0]: (pose,), KINDS[1]: (sure,), KINDS[2]: (frame + "x", sure, twist)}[kind]
    return bytes(store.serialize_cdr(types[kind](header, *values), kind))


def dds(kind: str) -> str:
    package, _, name = kind.split("/")
    return f"{package}::msg::dds_::{name}_"


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("frame", ["", "map", "world", "a_frame"])
def test_a_pose_is_read_as_it_was_written(kind: str, frame: str) -> None:
    payload = written(kind, frame)
    assert decode_pose(dds(kind), payload) == (5_000_000_006, frame, (PLACE, TURN), UNKNOWN)
    for length in range(60):
        with pytest.raises(WireError, match="short"):
            decode_pose(dds(kind), payload[:length])


@pytest.mark.parametrize("kind", KINDS[1:])
def test_the_deviations_of_a_pose_are_those_of_its_covariance(kind: str) -> None:
    def deviations(variances: dict[int, float]) -> tuple[float, ...]:
        return decode_pose(dds(kind), written(kind, "map", variances)).deviations

    assert deviations({0: 0.01, 7: 0.04, 14: 1e12, 21: 9.0, 35: 0.25}) == pytest.approx((0.1, 0.2, 1e3, 0.5))
    assert deviations({0: -1.0, 7: 0.04}) == deviations({0: math.nan, 7: 0.04}) == UNKNOWN
    assert deviations({0: 0.01, 7: math.nan, 35: 1e9}) == pytest.approx((0.1, 0.0, 0.0, math.pi))


def test_a_pose_is_written_as_a_foreign_encoder_does() -> None:
    assert encode_pose(5_000_000_006, PLACE, TURN) == written(KINDS[0], "world")


def test_other_types_and_keys_are_refused() -> None:
    with pytest.raises(WireError, match="type"):
        decode_pose(dds("std_msgs/msg/String"), written(KINDS[0], "map"))
    with pytest.raises(WireError, match="key"):
        body_of("0/cf1/odom/x/y")


@pytest.fixture
def port() -> int:
    return free_port()


@pytest.fixture
def source(port: int) -> Iterator[Ros2Source]:
    source = open_source(parse_source(f"ros2://127.0.0.1:{port}/vrpn_mocap?domain=7"))
    assert isinstance(source, Ros2Source)
    yield source
    source.close()


def test_poses_come_through_a_router_that_starts_later(source: Ros2Source, port: int) -> None:
    assert source.poll(0.01) == [] and "no pose" in source.detail
    router = opened(mode="router", listen={"endpoints": [f"tcp/127.0.0.1:{port}"]})
    node = opened(mode="client", connect={"endpoints": [f"tcp/127.0.0.1:{port}"]})
    codec, frames = Ros2Codec(), list[CapturedFrame]()
    try:
        deadline = time.monotonic() + 10.0
        while not (source.rejected["type"] and any(len(one.poses) == 2 for one in frames)):
            assert time.monotonic() < deadline, frames
            for body, kind in (("cf1", KINDS[0]), ("cf2", KINDS[2])):
                key = graph.topic_key(7, f"/vrpn_mocap/{body}/pose", kind, codec.hash_of(kind))
                node.put(key, written(kind, "world"))
            node.put("7/vrpn_mocap/cf3/pose/other_/hash", b"nothing that is known")
            frames += source.poll(0.05)
    finally:
        node.close()
        router.close()
    assert not source.detail and source.rejected["type"] >= 1
    # At a busy machine a frame may end between the two.
    assert {"cf1": (PLACE, TURN), "cf2": (PLACE, TURN)} in [frame.poses for frame in frames]


def test_the_address_names_router_topics_and_domain() -> None:
    address = parse_source("ros2://10.0.0.2:7450/a/b?domain=5")
    assert (address.host, address.port, address.path, address.domain) == ("10.0.0.2", 7450, "a/b", 5)
    assert parse_source("ros2://10.0.0.2").port == 7447
    with pytest.raises(ValueError, match="domain"):
        parse_source("ros2://10.0.0.2?domain=900")
