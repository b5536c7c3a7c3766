"""A Tello's video: pictures split into datagrams without numbers, and several vehicles that send to one port."""

import socket
import time
from contextlib import ExitStack, closing

import numpy as np
import pytest

from drivers.camera.sources.cut_pictures import Assembly
from drivers.camera.sources.frames import Packet
from drivers.camera.sources.nal_units import unit_types
from drivers.camera.sources.opening import open_source
from drivers.tello.video import WHOLE_BYTES
from drivers.tello.wire.text import VIDEO_PORT
from groundstation.arrays import Image
from sim_bridge.devices.h264 import GreyStream
from sim_bridge.render.tello_output import cut

SIZE = (320, 240)
PARAMETERS, KEY, PICTURE = {7, 8}, {5}, {1}


def picture(level: int) -> Image:
    noise = np.random.default_rng(level).integers(0, 40, (SIZE[1], SIZE[0]))
    return np.asarray(noise + level, dtype=np.uint8)


@pytest.fixture(scope="module")
def units() -> list[bytes]:
    stream = GreyStream(SIZE, 15.0, 2e6)
    return [stream.encode(picture(40 + number), want_idr=number == 0)[0] for number in range(6)]


def test_pictures_survive_being_cut(units: list[bytes]) -> None:
    assembly, found = Assembly(WHOLE_BYTES), []
    for unit in units:
        found += [done for datagram in cut(unit) for done in assembly.feed(datagram)]
    assert [one.data.rstrip(b"\0") for one in found] == [unit.rstrip(b"\0") for unit in units]
    assert [one.starts for one in found] == [True] + [False] * 5
    assert set(unit_types(units[0])) >= PARAMETERS | KEY and set(unit_types(units[1])) >= PICTURE


def test_parameter_sets_in_datagrams_of_their_own_begin_the_next_picture(units: list[bytes]) -> None:
    place = units[0].find(b"\0\0\1\x65")
    sets, key = units[0][:place], units[0][place:]
    assembly = Assembly(WHOLE_BYTES)
    assert not assembly.feed(sets)
    done = [one for datagram in cut(key) for one in assembly.feed(datagram)]
    assert [one.starts for one in done] == [True]


def test_a_picture_that_fills_its_datagrams_ends_all_the_same() -> None:
    full = b"\0\0\1\x41" + b"\x55" * (2 * WHOLE_BYTES - 4)
    sizes = [len(datagram) for datagram in cut(full)]
    assert sizes == [WHOLE_BYTES, WHOLE_BYTES, 1]
    assert [bool(Assembly(WHOLE_BYTES).feed(datagram)) for datagram in cut(full)] == [False, False, False]
    assembly = Assembly(WHOLE_BYTES)
    assert [bool(assembly.feed(datagram)) for datagram in cut(full)] == [False, False, True]


def filled(unit: bytes) -> list[bytes]:
    """Return the datagrams of a picture whose size is made a multiple of theirs by a unit of filler."""
    unit += b"\0\0\1\x0c" + b"\xff" * (-(len(unit) + 5) % WHOLE_BYTES) + b"\x80"
    return [unit[place : place + WHOLE_BYTES] for place in range(0, len(unit), WHOLE_BYTES)]


def test_a_picture_of_full_datagrams_only_ends_where_the_next_begins(units: list[bytes]) -> None:
    assembly = Assembly(WHOLE_BYTES)
    datagrams = [*cut(units[0]), *filled(units[1]), *filled(units[2]), *cut(units[3])]
    found = [one for datagram in datagrams for one in assembly.feed(datagram)]
    assert [list(unit_types(one.data)).count(1) for one in found] == [0, 1, 1, 1]
    assert found[3].data == units[3]


def test_two_pictures_can_end_with_one_datagram() -> None:
    small, assembly = b"\0\0\0\1\x41\x9a\x55", Assembly(WHOLE_BYTES)
    (full,) = filled(small)
    assert not assembly.feed(full)
    assert [one.data for one in assembly.feed(small)] == [full, small]


def test_bytes_that_are_no_video_are_counted() -> None:
    assembly = Assembly(WHOLE_BYTES)
    assert not assembly.feed(b"ok") and assembly.skipped == 2
    for _ in range(1000):
        assert not assembly.feed(b"\xff" * WHOLE_BYTES)
    assert assembly.skipped > 1 << 20


def send(udp: socket.socket, unit: bytes) -> None:
    for datagram in cut(unit):
        udp.sendto(datagram, ("127.0.0.70", VIDEO_PORT))


def test_pictures_that_the_link_held_back_are_not_shown(units: list[bytes]) -> None:
    """After 0.5 s without any, those of that time come at once."""
    with closing(open_source("tello://127.0.0.73")) as source, ExitStack() as stack:
        udp = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        udp.bind(("127.0.0.73", 0))
        while not source.connected:
            send(udp, units[0])
            time.sleep(0.05)
        for _ in range(12):
            send(udp, units[0])
            time.sleep(0.05)
        source.take_newest(0.2)
        time.sleep(0.5)
        for _ in range(10):
            send(udp, units[0])
            assert source.take_newest(0.004) is None
        seen = 0
        for _ in range(5):
            time.sleep(0.05)
            send(udp, units[0])
            seen += source.take_newest(0.2) is not None
        assert seen >= 3 and 7 <= source.rejected["held_back"] <= 11


def test_two_vehicles_that_send_to_one_port_are_kept_apart(units: list[bytes]) -> None:
    pictures = (units[0], GreyStream(SIZE, 15.0, 2e6).encode(picture(180), want_idr=True)[0])
    addresses = ("127.0.0.71", "127.0.0.72")
    newest: dict[int, Packet] = {}
    with ExitStack() as stack:
        sources = [stack.enter_context(closing(open_source(f"tello://{address}"))) for address in addresses]
        senders = [stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in addresses]
        for udp, address in zip(senders, addresses, strict=True):
            udp.bind((address, 0))
        deadline = time.monotonic() + 10.0
        while sum(source.received > 20 for source in sources) < 2 and time.monotonic() < deadline:
            for udp, unit in zip(senders, pictures, strict=True):
                send(udp, unit)
            newest |= {number: taken for number, source in enumerate(sources) if (taken := source.take_newest(0.01))}
    levels = [float(newest[number].picture.grey().mean()) for number in range(2)]  # type: ignore[union-attr]
    assert levels == pytest.approx([16 + 60 * 219 / 255, 16 + 200 * 219 / 255], abs=8)
