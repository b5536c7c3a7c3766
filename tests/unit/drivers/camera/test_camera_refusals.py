"""Checks of a camera stream before its pictures: silence, refusals, sizes in the header."""

from collections import Counter

import cv2
import numpy as np
import pytest
from fake_camera import FakeChild, FakeSource, settings

from drivers.camera import driver
from drivers.camera.source_address import SourceAddress, SourceKind, parse_source
from drivers.stream_watch import StreamState, StreamWatch
from groundstation.bus import clock
from groundstation.bus.jpeg import whole_size
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange


def test_stream_watch():
    watch = StreamWatch(5.0, 1.0, 0)
    assert not watch.look(4_000_000_000)
    assert watch.look(5_000_000_000)
    assert not watch.look(6_000_000_000)
    assert watch.usable(7_000_000_000)
    assert not watch.usable(7_100_000_000)
    assert watch.look(8_200_000_000)
    assert watch.state is StreamState.SILENT
    assert watch.refused("too small", 9_000_000_000)
    assert not watch.refused("too small", 9_100_000_000)


@pytest.mark.parametrize("progressive", [0, 1])
@pytest.mark.parametrize("shape", [(1, 1), (48, 64), (720, 1280, 3)])
def test_the_size_of_a_jpeg_is_in_its_head(shape, progressive):
    data = cv2.imencode(".jpg", np.zeros(shape, np.uint8), (cv2.IMWRITE_JPEG_PROGRESSIVE, progressive))[1].tobytes()
    assert whole_size(data) == (shape[1], shape[0])
    assert whole_size(data + b"\r\n") == (shape[1], shape[0])
    assert whole_size(data[:-2]) is None


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xff\xd8\xff\xd9",
        b"\xff\xd8" + b"\xff" * 5000 + b"\xff\xd9",
        b"\xff\xd8\xff\xe0\x00\x00\xff\xd9",
        b"\xff\xd8\xff\xc0\x00\x11\x08\x00\x00\x00\x10\xff\xd9",
        b"\x89PNG\r\n\x1a\n",
    ],
)
def test_incomplete_jpegs_have_no_size(data):
    assert whole_size(data) is None


def test_any_bytes_have_a_size_or_none():
    random = np.random.default_rng(4)
    whole = cv2.imencode(".jpg", np.zeros((48, 64), np.uint8))[1]
    for _ in range(2000):
        data = whole.copy()
        data[random.integers(2, len(data) - 2, 6)] = random.integers(0, 256, 6)
        size = whole_size(data.tobytes())
        assert size is None or (0 < size[0] < 65536 and 0 < size[1] < 65536)


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("http://10.0.0.5/a?b=1", SourceAddress(SourceKind.HTTP, "10.0.0.5", 80, "/a?b=1")),
        ("ardrone://192.168.1.1", SourceAddress(SourceKind.VEHICLE, "192.168.1.1", 5555, vehicle="ardrone")),
        ("ardrone://192.168.1.1:5600", SourceAddress(SourceKind.VEHICLE, "192.168.1.1", 5600, vehicle="ardrone")),
        ("rtsp://me:pass@cam/live", SourceAddress(SourceKind.RTSP, "cam", 554, "/live", "me:pass")),
        ("http://me:p%40ss%2F@cam/", SourceAddress(SourceKind.HTTP, "cam", 80, "/", "me:p@ss/")),
        ("/dev/video2", SourceAddress(SourceKind.DEVICE, path="/dev/video2")),
        ("file:///a b/c.mp4", SourceAddress(SourceKind.FILE, path="/a b/c.mp4")),
        ("/a/pictures", SourceAddress(SourceKind.FILE, path="/a/pictures")),
    ],
)
def test_sources_are_taken_apart(text, address):
    assert parse_source(text) == address


@pytest.mark.parametrize(
    ("refused", "why"),
    [
        ({}, "connected, but nothing comes"),
        ({"bytes": 900, "second publisher": 5}, "connected, but nothing comes"),
        ({"multipart": 20, "unreadable": 7}, "27 came that cannot be decoded"),
        ({"after_lost_picture": 1, "before_key_picture": 24, "h264": 2}, "25 came, but no key picture"),
        ({"held_back": 9}, "9 came that the link had held back"),
    ],
)
def test_a_camera_whose_pictures_are_refused_is_not_said_to_send_none(refused, why):
    """It was: "connected, but nothing comes"."""
    child, source = FakeChild(MemoryBus(MemoryExchange(), "lab", "drone_1_camera")), FakeSource()
    source.rejected = Counter(jpeg=4, bytes=1)
    jpeg = cv2.imencode(".jpg", np.zeros((360, 640), np.uint8))[1].tobytes()
    camera = driver.CameraDriver(child, settings(), source)
    source.push(jpeg)
    camera.turn()
    source.rejected += Counter(refused)
    end_ns = clock.now_ns() + 100_000_000
    while clock.now_ns() < end_ns:
        camera.turn()
    assert child.states[-1][0] == "DEGRADED" and f"0.05 s ({why}" in child.states[-1][1]


def test_damaged_pictures_are_counted_as_such():
    child, source = FakeChild(MemoryBus(MemoryExchange(), "lab", "drone_1_camera")), FakeSource()
    camera = driver.CameraDriver(child, settings(), source)
    end_ns = clock.now_ns() + 100_000_000
    while clock.now_ns() < end_ns:
        source.push(b"\xff\xd8 torn")
        camera.turn()
    assert "came that cannot be decoded" in child.states[-1][1]
