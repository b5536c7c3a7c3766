"""A flight's messages in ROS 2: values, frames, keys and tokens, and a bag that its own reader opens."""

import math
from collections import Counter
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

pytest.importorskip("rosbags")
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from ruamel.yaml import YAML

from drivers.rmw_zenoh.wire import graph
from drivers.ros2.settings import Ros2Section
from groundstation.bus import codec as bus_codec
from groundstation.bus import keys
from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.topics import TOPICS, Topic
from groundstation.engineering_views.ros2.advertised import advertised
from groundstation.engineering_views.ros2.bag import write_bag
from groundstation.engineering_views.ros2.codec import DISTRIBUTIONS, Ros2Codec, RosMessage
from groundstation.engineering_views.ros2.scene import SHOWN, Ros2Scene
from groundstation.geometry.angles import euler_from_quaternion
from groundstation.recording.run import open_run
from groundstation.recording.synthetic import SyntheticRun, write_run
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

STAMP_NS = 1_700_000_000_250_000_000
CODEC = Ros2Codec()


def header(entity: str = "drone_1") -> m.Header:
    return m.Header(1, "boot", entity, "tracker", 1)


def scene() -> Ros2Scene:
    return Ros2Scene(CODEC, None)


def taken(message: m.Message) -> dict[str, Any]:
    return {one.topic: read(one) for one in scene().take(STAMP_NS, message)}


def read(message: RosMessage, codec: Ros2Codec = CODEC) -> Any:
    return codec.store.deserialize_cdr(message.data, message.type)


def robot_heading_along_y() -> m.EntityEstimate:
    covariance = np.diag([0.04, 0.09, 0.01, 0.25])
    covariance[0, 1] = covariance[1, 0] = 0.02
    mean = (1.0, 2.0, 1.5, math.pi / 2)
    return m.EntityEstimate("drone_1", "robot", mean, tuple(covariance.ravel()), (0.0, 0.3, 0.1), True, 0.0)


def test_an_estimate_is_a_frame_a_pose_and_odometry() -> None:
    found = taken(m.Estimate(header=header("team"), entities=(robot_heading_along_y(),), epoch=1))
    (frame,) = found["/tf"].transforms
    assert (frame.header.frame_id, frame.child_frame_id) == ("world", "drone_1")
    assert (frame.header.stamp.sec, frame.header.stamp.nanosec) == (1_700_000_000, 250_000_000)
    rotation = frame.transform.rotation
    assert (rotation.z, rotation.w) == pytest.approx((math.sqrt(0.5), math.sqrt(0.5)))
    covariance = found["/skein/drone_1/pose"].pose.covariance.reshape(6, 6)
    assert covariance[0, 1] == 0.02 and covariance[5, 5] == 0.25 and covariance[3, 3] == 1e6
    # Odometry's twist is in the body's frame: it flies along y, which is where it heads.
    assert found["/skein/drone_1/odom"].twist.twist.linear.x == pytest.approx(0.3)
    assert found["/skein/drone_1/odom"].twist.twist.linear.y == pytest.approx(0.0)
    assert len(found["/skein/markers"].markers) == 2


def test_the_covariance_of_a_twist_is_that_of_the_velocity_in_its_own_frame() -> None:
    spread = (0.04, 0.01, 0.0, 0.01, 0.09, 0.002, 0.0, 0.002, 0.0)
    robot = msgspec.structs.replace(robot_heading_along_y(), velocity_covariance=spread)
    target = m.EntityEstimate("bot", "target", (1.0, 2.0), (0.01, 0.0, 0.0, 0.02), (0.1, 0.0), True, 0.0)
    target = msgspec.structs.replace(target, velocity_covariance=(0.5, 0.1, 0.1, 0.7))
    found = taken(m.Estimate(header=header("team"), entities=(robot, target), epoch=1))
    told = found["/skein/drone_1/odom"].twist.covariance.reshape(6, 6)
    assert told[:3, :3].tolist() == [[0.04, 0.01, 0.0], [0.01, 0.09, 0.002], [0.0, 0.002, 1e-6]], "0 means unknown"
    assert np.diag(told)[3:].tolist() == [1e6] * 3
    planar = found["/skein/bot/odom"].twist.covariance.reshape(6, 6)
    assert planar[:2, :2].tolist() == [[0.5, 0.1], [0.1, 0.7]] and np.diag(planar)[2:].tolist() == [1e6] * 4


def test_a_velocity_without_covariance_is_said_to_be_unknown() -> None:
    found = taken(m.Estimate(header=header("team"), entities=(robot_heading_along_y(),), epoch=1))
    told = found["/skein/drone_1/odom"].twist.covariance.reshape(6, 6)
    assert (told == np.diag([1e6] * 6)).all()


def test_a_true_pose_has_its_tilt() -> None:
    true = m.TruthState(
        header=header(),
        position_m=(1.0, 2.0, 3.0),
        velocity_m_s=(0.0,) * 3,
        attitude_rad=(0.1, -0.2, 0.3),
        on_ground=False,
    )
    turn = taken(true)["/skein/drone_1/truth"].pose.orientation
    assert euler_from_quaternion((turn.w, turn.x, turn.y, turn.z)) == pytest.approx((0.1, -0.2, 0.3))


def test_a_planar_target_says_nothing_of_height_and_heading() -> None:
    target = m.EntityEstimate("bot", "target", (1.0, 2.0), (0.01, 0.0, 0.0, 0.02), (0.1, 0.0), True, 0.0)
    pose = taken(m.Estimate(header=header("team"), entities=(target,), epoch=1))["/skein/bot/pose"]
    covariance = pose.pose.covariance.reshape(6, 6)
    assert covariance[1, 1] == 0.02 and covariance[2, 2] == covariance[5, 5] == 1e6


def test_an_unknown_battery_is_not_an_empty_one() -> None:
    status = m.VehicleStatus(header=header(), flight_state=m.FlightState.LOST, mode="HOVER", detail="not heard")
    found = taken(status)
    assert math.isnan(found["/skein/drone_1/battery"].percentage)
    (line,) = found["/diagnostics"].status
    assert line.level == 2 and "not heard" in line.message


def test_a_process_that_the_supervisor_speaks_for_is_named_as_when_it_speaks() -> None:
    said = m.Header(1, "clock", "drone_1", "supervisor", 1)
    found = taken(m.ProcessStatus(header=said, state=m.Lifecycle.STOPPING, pid=1, cpu=0.0, ticks=0))
    (line,) = found["/diagnostics"].status
    assert line.name == "skein: process drone_1"


def flight() -> list[m.Message]:
    """Return a message of each topic of a synthetic run."""
    seen: dict[Topic, m.Message] = {}
    for _, sample in SyntheticRun().samples(0.0, 11.0):
        key = keys.parse(sample.key)
        if key.topic.type is not None and key.topic not in seen:
            seen[key.topic] = bus_codec.decode(key, sample.payload)
    return list(seen.values())


def test_the_topics_shown_are_exactly_those_listed() -> None:
    made, said = scene(), set()
    for message in sorted(flight(), key=lambda one: isinstance(one, m.Estimate)):
        topic = next(topic for topic in TOPICS.values() if topic.type is type(message))
        if made.take(STAMP_NS, message):
            said.add(topic)
    assert said == SHOWN - {t.IMAGE, t.PLAN}, "a plan is drawn with the next estimate"


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_bytes_are_those_of_the_type_store_in_every_distribution(distribution: str) -> None:
    codec = Ros2Codec(distribution)
    made = Ros2Scene(codec, resolved_field(load_field(find_field("lab"), ())))
    found = [one for message in flight() for one in made.take(STAMP_NS, message)]
    found += [*made.take_picture(STAMP_NS, "ceiling", b"\xff\xd8"), made.static(1)]
    assert len({one.type for one in found}) == 11, "all of docs/reference/ros2.md 3"
    for one in found:
        assert bytes(codec.store.serialize_cdr(read(one, codec), one.type)) == one.data, one.topic


def test_frames_of_a_team_are_one_message_whoever_is_in_it() -> None:
    made, drone = scene(), robot_heading_along_y()
    target = m.EntityEstimate("bot", "target", (3.0, 4.0), (0.01, 0.0, 0.0, 0.02), (0.1, 0.0), True, 0.0)
    for entities in ((drone, target), (target, drone), (target,), (drone, target)):
        estimate = m.Estimate(header=header("team"), entities=entities, epoch=1)
        frames = {one.topic: read(one) for one in made.take(STAMP_NS, estimate)}["/tf"].transforms
        assert [frame.child_frame_id for frame in frames] == [entity.name for entity in entities]
        for frame, entity in zip(frames, entities, strict=True):
            assert (frame.transform.translation.x, frame.transform.translation.y) == entity.mean[:2]
            assert frame.header.stamp.nanosec == 250_000_000


def test_markers_come_five_times_a_second_with_what_was_new() -> None:
    made, robot = scene(), robot_heading_along_y()
    setpoint = m.VelocitySetpoint(
        header=header(), velocity_m_s=(0.5, 0.0, 0.0), yaw_rate_rad_s=0.0, lifetime_ms=300, epoch=1
    )
    pictures = []
    for turn in range(21):
        if turn == 1:
            made.take(STAMP_NS, setpoint)
        estimate = m.Estimate(header=header("team"), entities=(robot,), epoch=1)
        found = made.take(STAMP_NS + turn * 100_000_000, estimate)
        pictures += [read(one).markers for one in found if one.topic == "/skein/markers"]
    assert [len(markers) for markers in pictures] == [2, 3, *[2] * 9]
    ellipse, name, arrow = pictures[1]
    assert name.text == "drone_1" and ellipse.lifetime.sec == 1
    # It heads along y, so forward at 0.5 m/s is two seconds of that along y.
    begin, end = arrow.points
    assert (end.x - begin.x, end.y - begin.y) == pytest.approx((0.0, 1.0))
    # The major axis of [[0.04, 0.02], [0.02, 0.09]] is at 70 degrees; its 95 % semi-axis is 2.448 sigma.
    assert ellipse.scale.x == pytest.approx(2 * 2.448 * math.sqrt(0.0970), rel=1e-2)
    assert 2 * math.atan2(ellipse.pose.orientation.z, ellipse.pose.orientation.w) == pytest.approx(1.2326, abs=1e-2)


def test_keys_tokens_and_attachments_are_those_of_rmw_zenoh() -> None:
    kind = "std_msgs/msg/String"
    assert Ros2Codec("humble").hash_of(kind) == "TypeHashNotSupported"
    known = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
    assert Ros2Codec("jazzy").hash_of(kind) == known
    assert graph.topic_key(5, "/chatter", kind, known) == f"5/chatter/std_msgs::msg::dds_::String_/{known}"
    assert graph.node_token(5, "abc", "skein") == "@ros2_lv/5/abc/0/0/NN/%/%/skein"
    token = graph.publisher_token(5, "abc", "skein", 3, "/drone_1/odom", kind, known)
    assert token == (f"@ros2_lv/5/abc/0/3/MP/%/%/skein/%drone_1%odom/std_msgs::msg::dds_::String_/{known}/::,10:,:,:,,")
    assert graph.attachment(2, 3, b"x" * 16) == b"\2" + bytes(7) + b"\3" + bytes(7) + b"\x10" + b"x" * 16


def test_nothing_of_ours_stands_where_the_robots_own_node_speaks() -> None:
    """Otherwise an estimate passes for a robot's odometry: to its own driver, whose silence it hides, and to others."""
    shared = {"/tf", "/tf_static", "/diagnostics", "/rosout"}
    said = advertised(resolved_field(load_field(find_field("lab"))), truth=True)
    assert {name for name in said if not name.startswith("/skein/")} == shared
    for robot in ("drone_1", "turtlebot"):
        section = Ros2Section(namespace=robot)
        assert not {f"/{section.topic(name)}" for name in (section.odometry, section.battery)} & said.keys()


def test_a_bag_holds_what_its_own_reader_decodes(tmp_path: Path) -> None:
    write_run(tmp_path / "run", load_field(find_field("lab"), ()).model_dump_json().encode(), 1.0)
    count, unread = write_bag(open_run(tmp_path / "run"), tmp_path / "bag")
    (file,) = (tmp_path / "bag").glob("*.mcap")
    with file.open("rb") as stream:
        read = list(make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages())
    topics = {one.channel.topic for one in read}
    assert unread == [] and len(read) == count and len(topics) >= 15, topics
    assert {"/tf", "/tf_static", "/skein/drone_1/odom", "/skein/markers", "/diagnostics"} <= topics
    field = resolved_field(load_field(find_field("lab")))
    types = {one.channel.topic: one.schema.name for one in read if one.schema}
    assert types.items() <= advertised(field, truth=True).items(), "a live view advertises all that a flight tells"
    described = YAML(typ="safe").load(tmp_path / "bag" / "metadata.yaml")["rosbag2_bagfile_information"]
    assert described["version"] == 8, "the newest one that Humble reads"
    counts = {one["topic_metadata"]["name"]: one["message_count"] for one in described["topics_with_message_count"]}
    assert counts == Counter(one.channel.topic for one in read)
    # By the numbers of rmw: 1 is transient local, which tf2 requires of static frames, 2 volatile.
    offered = {one["topic_metadata"]["name"]: offers(one) for one in described["topics_with_message_count"]}
    assert {topic: one["durability"] for topic, one in offered.items()} == dict.fromkeys(topics, 2) | {"/tf_static": 1}
    assert {one["reliability"] for one in offered.values()} == {1}


def test_nothing_is_left_of_a_bag_that_could_not_be_finished(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_run(tmp_path / "run", load_field(find_field("lab"), ()).model_dump_json().encode(), 1.0)

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Ros2Scene, "_truth", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_bag(open_run(tmp_path / "run"), tmp_path / "bag")
    assert not (tmp_path / "bag").exists()


def offers(topic: dict[str, Any]) -> dict[str, Any]:
    """Return the one QoS of a topic's metadata, which version 8 keeps as a text."""
    (one,) = YAML(typ="safe").load(topic["topic_metadata"]["offered_qos_profiles"])
    return dict(one)
