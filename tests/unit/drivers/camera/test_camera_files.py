"""Pictures from the disk: video files and folders, and their errors."""

import itertools
import os
import time
from contextlib import contextmanager
from functools import partial
from types import SimpleNamespace

import av
import cv2
import numpy as np
import pytest
from patience import wait_for

from drivers.camera.sources.container import device
from drivers.camera.sources.frames import Packet
from drivers.camera.sources.opening import open_source
from drivers.camera.sources.reader_thread import Drain
from groundstation.time_units import NS_PER_S


@contextmanager
def opened(source):
    reading = open_source(str(source)) if not isinstance(source, Drain) else source
    try:
        yield reading
    finally:
        reading.close()


def write_video(path, codec, count=6, rate=30, pixel_format="yuv420p"):
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=rate)
        stream.width, stream.height = 160, 96
        stream.pix_fmt = "yuvj420p" if codec == "mjpeg" else pixel_format
        for number in range(count):
            pixels = np.full((96, 160, 3), 20 + 20 * number, np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(pixels, "bgr24")))
        container.mux(stream.encode())
    return path


def taken(source):
    """Return the pictures of a source until it has ended (10 s at most)."""
    pictures: list[Packet] = []
    deadline = time.monotonic() + 10.0
    while "ended" not in source.detail or source.received != (pictures[-1].number if pictures else -1):
        assert time.monotonic() < deadline, source.detail
        packet = source.take_newest(0.05)
        if packet is not None:
            pictures.append(packet)
    return pictures


@pytest.mark.parametrize(("name", "codec"), [("a.mp4", "libx264"), ("a.avi", "mjpeg"), ("a.mkv", "mpeg4")])
def test_a_video_plays_once_at_its_rate_and_says_that_it_has_ended(tmp_path, name, codec):
    with opened(write_video(tmp_path / name, codec)) as source:
        pictures = taken(source)
        levels = [round(float(packet.picture.grey().mean())) for packet in pictures]
        assert levels == sorted(levels) and levels[-1] > levels[0] + 30
        shown_ms = (pictures[-1].settled_ns - pictures[0].settled_ns) / 1e6
        assert shown_ms == pytest.approx((pictures[-1].number - pictures[0].number) * 1000 / 30, abs=2)
        assert not source.connected
        assert source.detail == f"{name}: ended after 6 pictures"
        assert source.take_video() == []


def test_a_slow_reader_of_a_file_gets_the_newest(tmp_path):
    with opened(write_video(tmp_path / "a.mp4", "libx264")) as source:
        wait_for(lambda: source.received == 6)
        packet = source.take_newest(0.1)
        assert packet is not None and packet.number == 6
        assert source.take_newest(0.01) is None


def test_a_folder_is_shown_by_name_without_what_is_no_picture(tmp_path):
    for name, level in (("b.png", 60), ("a.jpg", 40), ("c.jpg", 90)):
        cv2.imwrite(str(tmp_path / name), np.full((48, 64), level, np.uint8))
    (tmp_path / "aa.jpg").write_bytes(b"no picture")
    (tmp_path / "notes.txt").write_text("no picture either")
    with opened(f"file://{tmp_path}") as source:
        pictures = taken(source)
        assert [round(float(p.picture.grey().mean()), -1) for p in pictures] == [40, 60, 90]
        assert pictures[0].picture.grey().shape == (48, 64)
        assert pictures[0].picture.jpeg().startswith(b"\xff\xd8")
        assert source.rejected["unreadable"] == 1


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda path: None, "no such file"),
        (lambda path: path.mkdir(), "no picture in it"),
        (lambda path: path.write_bytes(b"not a video at all" * 50), "is no video, picture file or folder"),
        (lambda path: path.write_bytes(b""), ""),
        (os.mkfifo, "neither a file nor a folder"),
    ],
)
def test_errors_of_video_files_and_folders_are_named(tmp_path, make, complaint):
    path = tmp_path / "flight.mp4"
    make(path)
    with opened(path) as source:
        wait_for(lambda: source.detail.startswith("flight.mp4: ") and complaint in source.detail)
        assert not source.connected


def test_an_absent_device_is_named():
    with opened("/dev/video97") as source:
        wait_for(lambda: source.detail.startswith("/dev/video97: ") and "No such file" in source.detail)


@pytest.mark.parametrize("pixel_format", ["yuyv422", "yuv420p", "gray", "bgr24"])
def test_raw_pictures_of_a_device_are_read(tmp_path, pixel_format, monkeypatch):
    """A file stands in for a camera of this machine: its pictures arrive uncompressed, in the same way and as fast."""
    arrivals = SimpleNamespace(now_ns=partial(next, itertools.count(NS_PER_S, NS_PER_S // 30)))
    monkeypatch.setattr("drivers.camera.sources.container.clock", arrivals)
    path = write_video(tmp_path / "raw.nut", "rawvideo", count=3, pixel_format=pixel_format)
    reader = device(str(path), None)
    reader._form, reader._choices = None, ({},)
    with opened(Drain(reader)) as source:
        wait_for(lambda: source.received >= 3)
        packet = source.take_newest(1.0)
        assert packet.picture.grey().shape == (96, 160)
        assert 10 < float(packet.picture.grey().mean()) < 75 and float(packet.picture.grey().std()) < 3
        assert source.take_video() == []
