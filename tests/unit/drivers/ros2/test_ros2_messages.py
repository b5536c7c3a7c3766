"""ROS 2 messages as a foreign encoder writes and reads them."""

import math
from typing import Any

import pytest

pytest.importorskip("rosbags")
import numpy as np

from drivers.rmw_zenoh.wire import graph, vehicle
from drivers.rmw_zenoh.wire.cdr import WireError
from groundstation.engineering_views.ros2.codec import DISTRIBUTIONS, Ros2Codec

CODEC = Ros2Codec()
TYPES: Any = CODEC.store.types
STAMP_NS = 5_000_000_006
ODOMETRY = vehicle.OdometryMessage(STAMP_NS, (1.0, -2.0, 0.7), (0.0, 0.0, 0.6, 0.8), (0.3, -0.1, 0.2), (0.0, 0.1, -0.4))


def header(frame: str) -> Any:
    return TYPES["std_msgs/msg/Header"](TYPES["builtin_interfaces/msg/Time"](5, 6), frame)


def parts(kind: str, names: str, values: tuple[float, ...]) -> Any:
    return CODEC.make(kind, **dict(zip(names, values, strict=True)))


def written(message: vehicle.OdometryMessage, frame: str = "odom") -> bytes:
    make, vector = CODEC.make, "geometry_msgs/msg/Vector3"
    place = parts("geometry_msgs/msg/Point", "xyz", message.position)
    turned = parts("geometry_msgs/msg/Quaternion", "xyzw", message.quaternion)
    pose = make("geometry_msgs/msg/Pose", position=place, orientation=turned)
    linear, angular = parts(vector, "xyz", message.velocity), parts(vector, "xyz", message.turn)
    twist = make("geometry_msgs/msg/Twist", linear=linear, angular=angular)
    content = make(
        vehicle.ODOMETRY, header=header(frame), child_frame_id=frame + "_x",
        pose=make("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=np.zeros(36)),
        twist=make("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=np.zeros(36)),
    )  # fmt: skip
    return CODEC.encode(vehicle.ODOMETRY, content)


@pytest.mark.parametrize("frame", ["", "odom", "map"])
def test_odometry_is_read_and_written_as_others_do(frame: str) -> None:
    assert vehicle.decode_odometry(written(ODOMETRY, frame)) == ODOMETRY
    assert vehicle.encode_odometry(ODOMETRY, frame, frame + "_x") == written(ODOMETRY, frame)


def test_odometry_that_cannot_be_flown_by_is_refused() -> None:
    from dataclasses import replace

    whole = written(ODOMETRY)
    for length in (0, 3, 20, 200, len(whole) - 400):
        with pytest.raises(WireError, match="short"):
            vehicle.decode_odometry(whole[:length])
    with pytest.raises(WireError, match="no number"):
        vehicle.decode_odometry(written(replace(ODOMETRY, velocity=(math.nan, 0.0, 0.0))))
    with pytest.raises(WireError, match="no rotation"):
        vehicle.decode_odometry(written(replace(ODOMETRY, quaternion=(0.0, 0.0, 0.0, 0.0))))
    with pytest.raises(WireError, match="encapsulation"):
        vehicle.decode_odometry(b"\x00\x07" + whole[2:])


def battery(share: float) -> bytes:
    unknown = dict.fromkeys(("temperature", "current", "charge", "capacity", "design_capacity"), math.nan)
    states = {"power_supply_status": 2, "power_supply_health": 1, "power_supply_technology": 3, "present": True}
    none = np.zeros(0, np.float32)
    content = CODEC.make(
        vehicle.BATTERY, header=header(""), voltage=11.1, percentage=share, cell_voltage=none, cell_temperature=none,
        location="", serial_number="", **unknown, **states,
    )  # fmt: skip
    return CODEC.encode(vehicle.BATTERY, content)


def test_a_charge_is_a_share_or_unknown() -> None:
    assert vehicle.decode_charge(battery(0.5)) == 0.5
    assert vehicle.encode_battery(STAMP_NS, 0.5) == battery(0.5)
    for unusable in (math.nan, 85.0, -0.1):
        with pytest.raises(WireError, match="no charge"):
            vehicle.decode_charge(battery(unusable))


@pytest.mark.parametrize("stamp_ns", [None, STAMP_NS])
def test_velocities_are_written_as_others_read_them(stamp_ns: int | None) -> None:
    payload = vehicle.encode_twist((0.1, -0.2, 0.3), -0.4, stamp_ns)
    kind = vehicle.TWIST if stamp_ns is None else vehicle.TWIST_STAMPED
    content: Any = CODEC.store.deserialize_cdr(payload, kind)
    told = content if stamp_ns is None else content.twist
    assert (told.linear.x, told.linear.y, told.linear.z) == (0.1, -0.2, 0.3)
    assert (told.angular.x, told.angular.y, told.angular.z) == (0.0, 0.0, -0.4)
    assert stamp_ns is None or (content.header.stamp.sec, content.header.frame_id) == (5, "base_link")
    assert vehicle.decode_twist(payload, stamp_ns is not None) == ((0.1, -0.2, 0.3), -0.4)


def test_nothing_is_one_byte() -> None:
    assert CODEC.encode(vehicle.EMPTY, CODEC.make(vehicle.EMPTY)) == vehicle.NOTHING


def test_answers_are_a_truth_and_words() -> None:
    assert vehicle.decode_answer(vehicle.encode_answer(False, "no GPS")) == (False, "no GPS")
    with pytest.raises(WireError, match="short"):
        vehicle.decode_answer(vehicle.encode_answer(True, "yes")[:-2])


def test_type_hashes_are_those_of_every_distribution_that_has_them() -> None:
    known = {kind: hashed for kind, hashed in vehicle.HASHES.items() if "/msg/" in kind}
    for distribution in set(DISTRIBUTIONS) - {"humble"}:
        assert {kind: Ros2Codec(distribution).hash_of(kind) for kind in known} == known


def test_a_publisher_is_named_by_the_attachment() -> None:
    assert graph.publisher_of(graph.attachment(3, STAMP_NS, b"0123456789abcdef")) == b"0123456789abcdef"
    assert graph.publisher_of(b"") == graph.publisher_of(b"short") == b""
