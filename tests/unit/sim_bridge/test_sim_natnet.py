"""The emulated NatNet system, asked as programs of others ask: their bytes, and where they wait for frames."""

import socket
import struct
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from free_port import free_port

from drivers.motion_capture.captured_frame import CapturedFrame
from drivers.motion_capture.settings import parse_source
from drivers.motion_capture.sources import NatnetSource
from drivers.motion_capture.wire import natnet
from sim_bridge.devices.captured_bodies import CapturedBodies
from sim_bridge.devices.natnet import MULTICAST_GROUP, NatnetEmulator
from sim_bridge.site import SiteCapture

HOST = "127.0.0.1"
# libmotioncapture 1.1: requests without content. It waits for the second answer where it asked, and for frames at the
# data port.
BARE_CONNECT, BARE_DESCRIPTIONS = bytes(4), bytes([4, 0, 0, 0])
# The client of the NatNet SDK 3.0: its name, and two versions.
SENDER = b"NatNetLib".ljust(256, b"\0") + bytes([3, 0, 0, 0]) * 2
CONNECT, DISCOVERY = b"\x00\x00\x08\x01" + SENDER, b"\x0e\x00\x08\x01" + SENDER
FRAME_RATE, UNKNOWN = b"\x02\x00\x0a\x00FrameRate\0", b"\x02\x00\x0c\x00TestRequest\0"
ECHO = bytes.fromhex("0c000800fa92951000000000")

Opened = Callable[..., tuple[NatnetEmulator, socket.socket]]


@pytest.fixture
def opened() -> Iterator[Opened]:
    """Return an emulated system of two bodies, and a socket that is connected to its port for requests."""
    closing: list[NatnetEmulator | socket.socket] = []

    def open_(group: str = "") -> tuple[NatnetEmulator, socket.socket]:
        place = (HOST, free_port(HOST, kind=socket.SOCK_DGRAM))
        volume = {"x_m": (-3.0, 3.0), "y_m": (-3.0, 3.0), "z_m": (-0.1, 3.0)}
        capture = SiteCapture.model_validate({"volume_m": volume})
        rng = np.random.default_rng(1)
        seen = CapturedBodies("mocap", capture, ("cf1", "cf2"), lambda: np.ones((2, 13)), rng, errors=False)
        system = NatnetEmulator("mocap", place, seen, group)
        client = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        client.connect(place)
        client.settimeout(5.0)
        closing.extend((system, client))
        return system, client

    yield open_
    for one in closing:
        one.close()


def asked(system: NatnetEmulator, client: socket.socket, datagram: bytes) -> tuple[int, bytes]:
    client.send(datagram)
    system.receive()
    return natnet.message_of(client.recv(2048))


def tick(system: NatnetEmulator, ticks: int) -> None:
    for _ in range(ticks):
        system.receive()
        system.send()


def kinds_waiting(one: socket.socket) -> list[int]:
    one.setblocking(False)
    kinds = []
    while True:
        try:
            kinds.append(natnet.message_of(one.recv(2048))[0])
        except BlockingIOError:
            return kinds


def test_a_client_that_asks_without_content_gets_names_where_it_asked_and_frames_at_its_data_port(opened) -> None:
    system, client = opened()
    kind, payload = asked(system, client, BARE_CONNECT)
    server = natnet.decode_server(payload)
    assert kind == natnet.SERVER_INFO and server.group == "" and server.data_port != client.getpeername()[1]
    tick(system, 20)  # before it opens its port
    client.send(BARE_DESCRIPTIONS)
    tick(system, 20)
    assert kinds_waiting(client) == [natnet.DESCRIPTIONS], "a frame in between would be taken for the names"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as data:
        data.bind(("", server.data_port))
        tick(system, 3000)  # it never sends again
        assert len(set(kinds_waiting(data))) == 1
        tick(system, 20)
        assert kinds_waiting(data) == [natnet.FRAME] * 10
    tick(system, 4)  # it is gone: nothing is sent to a program that has the port later
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("", server.data_port))
        tick(system, 20)
        assert kinds_waiting(other) == []


def test_a_client_that_names_itself_gets_frames_where_it_asked_until_it_leaves(opened) -> None:
    system, client = opened()
    assert asked(system, client, CONNECT)[0] == natnet.SERVER_INFO
    tick(system, 22)
    assert len(kinds_waiting(client)) >= 8
    client.send(natnet.encode(natnet.DISCONNECT))
    tick(system, 4)
    kinds_waiting(client)
    tick(system, 20)
    assert kinds_waiting(client) == []


def test_other_requests_are_answered_as_motive_does(opened) -> None:
    system, client = opened()
    assert natnet.decode_server(asked(system, client, DISCOVERY)[1]).name == "Skein"
    kind, stamps = asked(system, client, ECHO)
    assert kind == 13 and stamps[:8] == ECHO[4:] and struct.unpack("<Q", stamps[8:])[0] > 0
    assert asked(system, client, FRAME_RATE) == (3, struct.pack("<f", 100.0))
    assert asked(system, client, b"\x02\x00\x0a\x00Bitstream\0") == (3, b"Bitstream,4.1\0")
    assert asked(system, client, UNKNOWN)[0] == 100
    tick(system, 20)
    assert kinds_waiting(client) == [], "whoever asked for no connection gets no frames"


def test_frames_for_a_group_reach_our_client_and_no_port_that_asked(opened) -> None:
    system, client = opened(MULTICAST_GROUP)
    assert natnet.decode_server(asked(system, client, BARE_CONNECT)[1]).group == MULTICAST_GROUP
    source = NatnetSource(parse_source(f"natnet://{HOST}:{client.getpeername()[1]}"))
    frames: list[CapturedFrame] = []
    until = time.monotonic() + 10.0
    while len(frames) < 50 and time.monotonic() < until:
        tick(system, 2)
        frames += source.poll(0.01)
    source.close()
    assert len(frames) >= 50 and set(frames[-1].poses) == {"cf1", "cf2"}
    assert kinds_waiting(client) == []
