"""A real render process and the real reader: pictures over HTTP, faults, and no orphan after the parent's death."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import numpy as np
import pytest
from free_port import free_port

from drivers.camera.sources.opening import open_source
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.supervisor.runtime_file import start_time
from sim_bridge.render.process import run
from sim_bridge.render.spec import BoardSpec, Mount, Outage, OutageKind, PictureQuality, RenderSpec
from sim_bridge.truth import TruthBoard

pytestmark = pytest.mark.sitl
BODIES = ("drone_1",)


def make_spec(truth_name, port, **scenario):
    return RenderSpec(
        camera="ceiling",
        mount=Mount(Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 4.2]))),
        intrinsics=CameraIntrinsics(320, 180, 300.0, 300.0, 159.5, 89.5),
        boards=(BoardSpec("drone_1", 1, 44.0, (0.0, 0.0, 0.08)),),
        truth_name=truth_name,
        bodies=BODIES,
        address="127.0.0.1",
        port=port,
        scenario=PictureQuality(frame_loss=0.0, **scenario),
        parent_pid=os.getpid(),
    )


@contextmanager
def rendering(**scenario):
    """Yield (truth board, source, process) of a running camera."""
    name, port = f"{os.getpid()}-{time.monotonic_ns()}", free_port()
    truth = TruthBoard.create(name, BODIES)
    context = multiprocessing.get_context("spawn")
    process = context.Process(target=run, args=(make_spec(name, port, **scenario),))
    process.start()
    source = open_source(f"http://127.0.0.1:{port}/video.mjpg")
    try:
        yield truth, source, process
    finally:
        source.close()
        process.terminate()
        process.join(5.0)
        truth.close()


def write_until(truth, condition, seconds=15.0):
    """Advance the world at 100 Hz until an event; return the time that it took [s]."""
    began = time.monotonic()
    while not condition():
        assert time.monotonic() - began < seconds, "did not happen in time"
        truth.write(time.monotonic_ns(), np.zeros((1, 13)))
        time.sleep(0.01)
    return time.monotonic() - began


def test_pictures_arrive_by_the_delay_after_their_exposure():
    with rendering(video_delay_ms=120.0, video_jitter_ms=0.0, fps=15.0) as (truth, source, process):
        write_until(truth, lambda: source.received >= 3)
        source.take_newest(0.0)
        last_ns = time.monotonic_ns()
        truth.write(last_ns, np.zeros((1, 13)))
        time.sleep(0.5)  # the world stands still: its last state is exposed once, and nothing after it
        packet = source.take_newest(0.0)
        assert packet is not None
        assert 115 <= (packet.arrival_ns - last_ns) / 1e6 <= 200
        received = source.received
        time.sleep(0.3)
        assert source.received == received
        process.terminate()
        process.join(5.0)
        assert process.exitcode == 0


def test_a_cut_stream_heals():
    outages = (Outage(OutageKind.CUT, 3.0, 3.8),)
    with rendering(outages=outages) as (truth, source, _):
        write_until(truth, lambda: source.received >= 2)
        write_until(truth, lambda: not source.connected and "closed" in source.detail)
        received = source.received
        write_until(truth, lambda: source.received > received + 2)


def test_a_stalled_stream_stays_connected():
    outages = (Outage(OutageKind.STALL, 3.0, 4.0),)
    with rendering(outages=outages, fps=30.0) as (truth, source, _):
        write_until(truth, lambda: source.received >= 1)
        longest, last, arrivals = 0.0, time.monotonic(), source.received
        end = time.monotonic() + 4.5
        while time.monotonic() < end:
            truth.write(time.monotonic_ns(), np.zeros((1, 13)))
            time.sleep(0.01)
            if source.received != arrivals:
                longest, last, arrivals = max(longest, time.monotonic() - last), time.monotonic(), source.received
        assert longest > 0.6
        assert source.connected


def test_pictures_that_a_link_holds_back_are_sent_and_withheld():
    outages = (Outage(OutageKind.HELD_BACK, 4.0, 5.0),)
    with rendering(outages=outages, fps=15.0) as (truth, source, _):
        write_until(truth, lambda: source.rejected["held_back"] >= 6)
        source.take_newest(0.0)
        write_until(truth, lambda: source.take_newest(0.0) is not None)


_PARENT = """
import multiprocessing, sys, time
sys.path[:0] = {path!r}
from test_camera_process import BODIES, make_spec
from sim_bridge.render.process import run
if __name__ == "__main__":
    p = multiprocessing.get_context("spawn").Process(target=run, args=(make_spec({name!r}, {port}),))
    p.start(); print(p.pid, flush=True); time.sleep(60)
"""


def test_it_ends_with_its_parent(tmp_path):
    name = f"{os.getpid()}-orphan"
    truth = TruthBoard.create(name, BODIES)
    script = tmp_path / "parent.py"
    script.write_text(_PARENT.format(path=sys.path, name=name, port=free_port()))
    parent = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    try:
        child = int(parent.stdout.readline())
        time.sleep(0.3)
        os.kill(parent.pid, signal.SIGKILL)
        parent.wait(5.0)
        deadline = time.monotonic() + 15.0
        while start_time(child) is not None:
            assert time.monotonic() < deadline, "the render process outlived its parent"
            time.sleep(0.05)
    finally:
        parent.kill()
        parent.stdout.close()
        parent.wait(5.0)
        truth.close()
