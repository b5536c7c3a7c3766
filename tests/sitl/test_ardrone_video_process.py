"""A real render process serves an AR.Drone's video: exposure times, camera and size as configured, late not lost."""

import multiprocessing
import os
import socket
import time
from contextlib import contextmanager

import numpy as np
import pytest

from drivers.camera.sources.frames import Packet
from drivers.camera.sources.opening import open_source
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from sim_bridge.devices.ardrone_video_mode import VideoMode
from sim_bridge.own_video import OwnVideo
from sim_bridge.render.outputs import scaled
from sim_bridge.render.process import FrameDelay, run
from sim_bridge.render.spec import BoardSpec, BodyShape, Mount, PictureQuality, RenderSpec
from sim_bridge.truth import TruthBoard

pytestmark = pytest.mark.sitl
BODIES = ("drone_1", "bot")
# Looks at the wall; the board is right below, where only the bottom camera sees it.
LEVEL = Pose(np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), np.zeros(3))


def make_spec(truth_name, port, **scenario):
    return RenderSpec(
        camera="drone_1",
        mount=Mount(LEVEL, "drone_1"),
        intrinsics=CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5),
        boards=(BoardSpec("bot", 5, 44.0, (0.0, 0.0, 0.1), BodyShape.TURTLEBOT),),
        truth_name=truth_name,
        bodies=BODIES,
        address="127.0.0.1",
        port=port,
        scenario=PictureQuality(**scenario),
        parent_pid=os.getpid(),
        own=OwnVideo("sim_bridge.render.ardrone_output:ArDroneOutput"),
    )


@contextmanager
def rendering(**scenario):
    """Yield (truth board, source, function that sets modes) of a running camera."""
    name = f"{os.getpid()}-{time.monotonic_ns()}"
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    truth = TruthBoard.create(name, BODIES)
    context = multiprocessing.get_context("spawn")
    told, teller = context.Pipe(duplex=False)
    process = context.Process(target=run, args=(make_spec(name, port, **scenario), told))
    process.start()
    told.close()
    source = open_source(f"ardrone://127.0.0.1:{port}")
    try:
        yield truth, source, teller
    finally:
        source.close()
        teller.close()
        process.terminate()
        process.join(5.0)
        truth.close()


def states():
    rows = np.zeros((2, 13))
    rows[0, 2] = 1.5
    return rows


def pictures_until(truth, source, condition, seconds=20.0):
    """Advance the world at 100 Hz; return the packets up to the one that satisfies the condition."""
    packets, began = list[Packet](), time.monotonic()
    while not packets or not condition(packets):
        assert time.monotonic() - began < seconds, (source.detail, source.rejected)
        truth.write(time.monotonic_ns(), states())
        packet = source.take_newest(0.01)
        packets += [packet] if packet is not None else []
    return packets


@pytest.mark.slow
def test_exposures_are_known_in_spite_of_jitter_and_late_frames():
    with rendering(frame_loss=0.05, video_jitter_ms=20.0, video_delay_ms=120.0, fps=15.0) as (truth, source, _):
        packets = pictures_until(truth, source, lambda got: len(got) >= 75)
        late_ms = np.array([(p.arrival_ns - p.settled_ns) / 1e6 for p in packets[15:]])
        assert np.std(late_ms) > 8, "the link is not as uneven as it was told to be"
        steps_ms = np.diff([p.settled_ns / 1e6 for p in packets[15:]]) / np.diff([p.number for p in packets[15:]])
        assert np.median(np.abs(steps_ms - 1000 / 15)) < 12, "exposures are a grid of 15 a second"
        numbers = [p.number for p in packets]
        assert source.received == numbers[-1], "nothing is lost over TCP"


def test_configuration_chooses_bottom_camera_and_size():
    with rendering(frame_loss=0.0, video_delay_ms=5.0, video_jitter_ms=0.0) as (truth, source, teller):
        front = pictures_until(truth, source, lambda got: len(got) >= 3)[-1].picture.grey()
        teller.send(tuple(VideoMode(channel=1)))
        contrast = float(front.std())
        below = pictures_until(truth, source, lambda got: got[-1].picture.grey().std() > contrast + 8)[
            -1
        ].picture.grey()
        assert below.shape == (360, 640)
        middle = below[100:260, 240:400]
        assert middle.min() < 70 and middle.max() > 190, "the board below is in the middle of the picture"
        teller.send(tuple(VideoMode(codec=0x83)))
        large = pictures_until(truth, source, lambda got: got[-1].picture.grey().shape == (720, 1280))
        assert large[-1].picture.grey().std() < contrast + 8


def test_pictures_lost_by_tcp_are_late_and_delay_the_following():
    spec = make_spec("none", 0, frame_loss=0.3, video_jitter_ms=0.0, video_delay_ms=100.0)
    link = FrameDelay(spec)
    exposures = [k * 66_000_000 for k in range(400)]
    released_ns = [at for at in map(link.release_ns, exposures) if at is not None]
    assert len(released_ns) == 400, "nothing is lost for good"
    late_ms = [(at - e) / 1e6 for at, e in zip(released_ns, exposures, strict=True)]
    assert min(late_ms) == 100 and max(late_ms) == 300
    assert 0.25 < np.mean(np.array(late_ms) == 300) < 0.35
    released = [e / 1e6 + late for e, late in zip(exposures, late_ms, strict=True)]
    assert released == sorted(released)
    assert np.mean(np.array(late_ms) > 100) > 0.5, "pictures behind a lost one wait for it"


def test_a_lens_keeps_its_rays_in_another_picture_size():
    lens = CameraIntrinsics(1280, 720, 920.0, 921.0, 640.2, 359.1, (-0.3, 0.08, 0.0, 0.0, 0.0))
    small = scaled(lens, (640, 360))
    points = np.array([[0.3, -0.2, 1.5], [0.0, 0.0, 1.0], [-0.8, 0.4, 2.0]])
    assert small.project(points) + 0.5 == pytest.approx((lens.project(points) + 0.5) / 2)
