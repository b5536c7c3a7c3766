"""The emulated Tello's video: H.264 in datagrams, sent on time to the client that requested it."""

import math
import multiprocessing
import socket
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection

import numpy as np
import pytest

from drivers.tello.wire.text import VIDEO_PORT
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import base_from_tilted_optical
from sim_bridge.own_video import OwnVideo
from sim_bridge.render.outputs import Output, open_output
from sim_bridge.render.spec import BoardSpec, Mount, RenderSpec

LISTENER, STATES = "127.0.87.3", np.array([[0.0] * 13])


@pytest.fixture
def listener() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        made.bind((LISTENER, VIDEO_PORT))
        made.settimeout(5.0)
        yield made


@pytest.fixture
def asked() -> Iterator[tuple[Output, Connection]]:
    lens = CameraIntrinsics(320, 240, 260.0, 260.0, 159.5, 119.5, (0.0,) * 5)
    mount = Mount(Pose(base_from_tilted_optical(math.radians(45)), np.array([0.05, 0.0, 0.0])), "drone_1")
    boards = (BoardSpec("drone_1", 1, 44.0, (0, 0, 0.08)),)
    own = OwnVideo("sim_bridge.render.tello_output:TelloOutput")
    heard, said = multiprocessing.Pipe(duplex=False)
    output = open_output(RenderSpec("front", mount, lens, boards, "t", ("drone_1",), "127.0.87.2", 0, own=own), heard)
    yield output, said
    output.close()


def test_only_who_asked_gets_whole_units_and_a_key_picture_first(asked, listener) -> None:
    output, said = asked
    assert output.clients == 0
    said.send((LISTENER,))
    assert output.clients == 1
    output.show(STATES, 0, time.monotonic_ns() + 200_000_000, 0.0)
    began = time.monotonic()
    datagrams = [listener.recv(2048)]
    assert time.monotonic() - began > 0.1, "the picture is late as a real one is"
    while len(datagrams[-1]) == 1460:
        datagrams.append(listener.recv(2048))
    unit = b"".join(datagrams)
    assert unit[:4] == b"\0\0\0\1" and unit[4] & 0x1F == 7, "it begins with the parameters of the stream"
    assert {unit[i + 4] & 0x1F for i in range(len(unit) - 4) if unit[i : i + 4] == b"\0\0\0\1"} >= {7, 8}


def test_it_stops_when_told_so_and_when_the_vehicle_is_gone(asked) -> None:
    output, said = asked
    said.send((LISTENER,))
    output.set_accepting(False)
    assert output.clients == 0
    output.set_accepting(True)
    assert output.clients == 1
    said.send(())
    said.close()
    assert output.clients == 0
