"""ROS 2 images from a foreign encoder, through a ROS-like router, arrive at the camera reader."""

import json
import time
from collections.abc import Callable, Iterator
from statistics import median
from typing import Any

import cv2
import numpy as np
import pytest
from free_port import free_port

pytest.importorskip("rosbags")
import zenoh

from drivers.camera.source_address import SourceKind, parse_source
from drivers.camera.sources.frames import FrameSource, Packet
from drivers.camera.sources.opening import open_source
from drivers.rmw_zenoh.wire import graph
from groundstation.engineering_views.ros2.codec import Ros2Codec

CODEC = Ros2Codec()
TOPIC, DOMAIN = "/camera/image", 5
# Not a limit to be tested: a busy machine may be slow.
_PATIENCE_S = 30.0
IMAGE, COMPRESSED, STRING = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage", "std_msgs/msg/String"
# Blue, green, red in the corners, 6 x 4 pixels.
PIXELS = np.zeros((4, 6, 3), np.uint8)
PIXELS[0, 0], PIXELS[0, 5], PIXELS[3, 0] = (255, 0, 0), (0, 255, 0), (0, 0, 255)


def header(stamp_ns: int) -> Any:
    types: Any = CODEC.store.types
    return types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 10**9)), "camera")


def image(encoding: str, pixels: Any, stamp_ns: int = 10**9, pad: int = 0) -> tuple[str, bytes]:
    rows = pixels.reshape(pixels.shape[0], -1)
    data = np.pad(rows, ((0, 0), (0, pad))).ravel()
    content = CODEC.make(IMAGE, header=header(stamp_ns), height=pixels.shape[0], width=pixels.shape[1],
                         encoding=encoding, is_bigendian=0, step=rows.shape[1] + pad, data=data)  # fmt: skip
    return IMAGE, CODEC.encode(IMAGE, content)


def compressed(suffix: str, words: str = "", data: bytes | None = None) -> tuple[str, bytes]:
    file = cv2.imencode(suffix, PIXELS)[1].tobytes() if data is None else data
    content = CODEC.make(COMPRESSED, header=header(10**9), format=words, data=np.frombuffer(file, np.uint8))
    return COMPRESSED, CODEC.encode(COMPRESSED, content)


class Node:
    """A router with a node of its own."""

    def __init__(self) -> None:
        self.port = free_port()
        self.start()

    def start(self) -> None:
        settings = {"mode": "router", "listen": {"endpoints": [f"tcp/127.0.0.1:{self.port}"]},
                    "scouting": {"multicast": {"enabled": False}}}  # fmt: skip
        self.session: Any = zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))

    def say(self, message: tuple[str, bytes], publisher: bytes = b"the only one ...") -> None:
        kind, payload = message
        key = graph.topic_key(DOMAIN, TOPIC, kind, CODEC.hash_of(kind))
        self.session.put(key, payload, attachment=graph.attachment(1, 9, publisher))


@pytest.fixture(scope="module")
def node() -> Iterator[Node]:
    node = Node()
    yield node
    node.session.close()


@pytest.fixture
def source(node: Node) -> Iterator[FrameSource]:
    source = open_source(f"ros2://127.0.0.1:{node.port}{TOPIC}?domain={DOMAIN}")
    until(lambda: source.connected)
    # A router just joined may not know its subscribers yet; a refusal leaves no other trace.
    for _ in range(10):
        node.say(compressed("", "jpeg", b""))
        deadline = time.monotonic() + 3.0
        while not source.rejected and time.monotonic() < deadline:
            time.sleep(0.005)
        if source.rejected:
            break
    source.rejected.clear()
    yield source
    source.close()


def until(condition: Callable[[], object]) -> None:
    deadline = time.monotonic() + _PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, "did not happen in time"
        time.sleep(0.005)


def taken(node: Node, source: FrameSource, message: tuple[str, bytes]) -> Packet:
    for _ in range(5):  # a router just joined may not know its subscribers yet
        node.say(message)
        packet = source.take_newest(5.0)
        if packet is not None:
            return packet
    raise AssertionError(source.detail or "connected, but nothing comes")


def colours(packet: Packet) -> Any:
    assert packet.picture is not None
    return np.asarray(packet.picture.pixels)  # type: ignore[attr-defined]


def test_raw_and_compressed_pictures_arrive_with_their_colours(node: Node, source: FrameSource) -> None:
    grey = cv2.cvtColor(PIXELS, cv2.COLOR_BGR2GRAY)
    for pad in (0, 5):
        assert (colours(taken(node, source, image("bgr8", PIXELS, pad=pad))) == PIXELS).all()
        assert (colours(taken(node, source, image("rgb8", PIXELS[:, :, ::-1], pad=pad))) == PIXELS).all()
        assert (colours(taken(node, source, image("mono8", grey, pad=pad))) == grey).all()
    assert (colours(taken(node, source, compressed(".png", "png"))) == PIXELS).all()
    jpeg = taken(node, source, compressed(".jpg", "bgr8; jpeg compressed bgr8"))
    assert jpeg.picture is None and jpeg.data == cv2.imencode(".jpg", PIXELS)[1].tobytes()


def test_stamps_of_the_sender_free_arrivals_of_jitter(node: Node, source: FrameSource) -> None:
    # Stamps hardly apart: none of these pictures comes so soon after another that it had waited. The first one may have
    # been stored by its sender, so that its delay says nothing of the others'.
    stamps, arrivals = [10**9 + number * 1000 for number in range(8)], []
    for number, stamp_ns in enumerate(stamps):
        packet = taken(node, source, image("mono8", PIXELS[:, :, 0], stamp_ns))
        arrivals.append(packet.arrival_ns)
        usual_ns = median(np.subtract(arrivals, stamps[: number + 1]).tolist()[number > 0 :])
        assert packet.settled_ns == stamp_ns + round(usual_ns)
    stamped = taken(node, source, image("mono8", PIXELS[:, :, 0], 0))
    assert stamped.settled_ns == stamped.arrival_ns


def test_pictures_of_a_second_camera_under_the_same_topic_are_refused(node: Node, source: FrameSource) -> None:
    grey, other = image("mono8", PIXELS[:, :, 0]), image("mono8", PIXELS[:, :, 1])
    before = colours(taken(node, source, grey))
    node.say(other, b"another camera's")
    until(lambda: source.rejected["second publisher"])
    assert (colours(taken(node, source, grey)) == before).all()
    time.sleep(1.1)  # the first has been silent: another one may be its restarted node
    node.say(other, b"another camera's")
    heir = source.take_newest(_PATIENCE_S)
    assert heir is not None and (colours(heir) != before).any()


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ((STRING, b"\0\1\0\0"), "the topic's type is std_msgs/String: only sensor_msgs/CompressedImage and Image"),
        (image("yuv422", PIXELS[:, :, :2]), "its pictures are yuv422: only mono8, rgb8, bgr8 are read"),
        (compressed(".jpg", "h264", b"\0\0\0\1x"), "its pictures are h264: only JPEG and PNG are read"),
    ],
)
def test_unreadable_image_messages_are_named(
    node: Node, source: FrameSource, message: tuple[str, bytes], words: str
) -> None:
    node.say(message)
    until(lambda: not source.connected)
    assert words in source.detail and str(node.port) in source.detail
    said = time.monotonic()
    # It tries again, and accepts a better picture.
    while time.monotonic() - said < _PATIENCE_S and not source.connected:
        node.say(image("bgr8", PIXELS))
        time.sleep(0.02)
    assert source.connected and source.take_newest(1.0) is not None


def test_empty_and_damaged_pictures_are_counted_and_passed_over(node: Node, source: FrameSource) -> None:
    kind, whole = image("bgr8", PIXELS)
    empty = CODEC.make(IMAGE, header=header(1), height=0, width=0, encoding="bgr8", is_bigendian=0, step=0,
                       data=np.zeros(0, np.uint8))  # fmt: skip
    damaged = cv2.imencode(".png", PIXELS)[1].tobytes()
    huge = damaged[:16] + (60000).to_bytes(4, "big") * 2 + damaged[24:]
    for message in (
        compressed("", "jpeg", b""),
        (IMAGE, CODEC.encode(IMAGE, empty)),
        (kind, whole[:-3]),
        (kind, whole[: -len(PIXELS.tobytes()) - 4] + (3).to_bytes(4, "little") + b"abc"),
        compressed("", "png", damaged[:40]),
        compressed("", "png", huge),
    ):
        node.say(message)
    wanted = {"empty": 2, "short": 1, "size": 2, "unreadable": 1}
    until(lambda: all(source.rejected[reason] >= count for reason, count in wanted.items()))
    assert set(source.rejected) == set(wanted)
    assert (colours(taken(node, source, (kind, whole))) == PIXELS).all()


def test_a_router_that_goes_and_comes_back_is_joined_again() -> None:
    node = Node()
    source = open_source(f"ros2://127.0.0.1:{node.port}{TOPIC}?domain={DOMAIN}")
    try:
        until(lambda: source.connected)
        node.session.close()
        until(lambda: not source.connected)
        assert "the ROS 2 Zenoh router is gone" in source.detail
        node.start()
        until(lambda: source.connected)
        assert (colours(taken(node, source, image("bgr8", PIXELS))) == PIXELS).all()
    finally:
        source.close()
        node.session.close()


def test_an_address_names_router_topic_and_domain() -> None:
    address = parse_source("ros2://10.0.0.2/a/b?domain=7")
    assert (address.kind, address.host, address.port, address.path) == (SourceKind.ROS2, "10.0.0.2", 7447, "a/b")
    assert address.domain == 7 and parse_source("ros2://10.0.0.2:7450/a").port == 7450
    for wrong, words in (
        ("ros2://10.0.0.2", "must name a topic"),
        ("ros2://10.0.0.2/a?domain=900", "domain=0 to 232"),
        ("ros2://10.0.0.2%wlan1/a", "cannot be behind an adapter"),
    ):
        with pytest.raises(ValueError, match=words):
            parse_source(wrong)
