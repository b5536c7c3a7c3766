"""The kit's bad wire: damage, loss, reordering and a stranger, over any transport, reach only the emulator."""

import asyncio
import itertools
import random
import socket
from contextlib import ExitStack, contextmanager

import pytest

from sim_bridge.conformance.damage import damaged
from sim_bridge.conformance.wire import Wire

VEHICLE, STRANGER, HOST = "127.44.3.11", "127.44.3.111", "127.44.3.1"


@contextmanager
def ends():
    """A wire, with the vehicle's and the driver's sockets connected to each other."""
    with ExitStack() as stack:
        vehicle, driver = (stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(2))
        vehicle.bind((VEHICLE, 0))
        driver.bind((HOST, 0))
        vehicle.connect(driver.getsockname())
        for one in (vehicle, driver):
            one.setblocking(False)
        yield stack.enter_context(Wire(VEHICLE, STRANGER)), vehicle, driver


def all_of(listener):
    got = []
    while True:
        try:
            got.append(listener.recvfrom(2048))
        except BlockingIOError:
            return got


def by_asyncio(speaker, data):
    async def speak():
        own = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        own.bind((VEHICLE, 0))
        transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(asyncio.DatagramProtocol, sock=own)
        transport.sendto(data, speaker.getpeername())
        await asyncio.sleep(0)
        transport.close()

    asyncio.run(speak())


WAYS = {
    "send": lambda one, data: one.send(data),
    "sendto": lambda one, data: one.sendto(data, one.getpeername()),
    "sendto with flags": lambda one, data: one.sendto(data, 0, one.getpeername()),
    "sendmsg": lambda one, data: one.sendmsg([data[:3], memoryview(data)[3:]]),
    "sendmsg to": lambda one, data: one.sendmsg([data], [], 0, one.getpeername()),
    "asyncio": by_asyncio,
}


@pytest.mark.parametrize("way", WAYS)
def test_damage_follows_whatever_way_a_datagram_is_sent(way):
    with ends() as (wire, vehicle, driver):
        wire.copies = 7
        WAYS[way](vehicle, b"state 1 2 3")
        came = [data for data, _ in all_of(driver)]
    assert came[0] == b"state 1 2 3" and len(came) == 8 and set(came[1:]) != {came[0]}
    assert (wire.said, wire.damaged) == (1, 7)


def test_others_are_left_alone():
    with ends() as (wire, _, driver):
        wire.copies, wire.loss = 3, 1.0
        driver.sendto(b"to nobody", (HOST, driver.getsockname()[1]))
        assert [data for data, _ in all_of(driver)] == [b"to nobody"]
        assert wire.said == 0


@pytest.mark.parametrize("way", ["send", "sendto", "sendmsg"])
def test_a_share_is_lost_and_a_share_overtaken_from_the_vehicle(way):
    with ends() as (wire, vehicle, driver):
        wire.loss, wire.swap = 0.1, 0.1
        came = []
        for number in range(1000):
            WAYS[way](vehicle, b"%04d" % number)
            came += [int(data) for data, _ in all_of(driver)]
    assert 850 < len(came) < 950 and len(set(came)) == len(came)
    overtaken = sum(later < earlier for earlier, later in itertools.pairwise(came))
    assert 50 < overtaken < 120
    assert max(abs(number - place * 10 / 9) for place, number in enumerate(came)) < 60


@pytest.mark.parametrize("way", ["recv", "recvfrom", "recvmsg", "recv_into"])
def test_a_share_is_lost_to_the_vehicle(way):
    with ends() as (wire, vehicle, driver):
        wire.loss = 0.1
        heard = 0
        for _ in range(1000):
            driver.sendto(b"GO 1", vehicle.getsockname())
            try:
                getattr(vehicle, way)(bytearray(100) if way == "recv_into" else 100)
                heard += 1
            except BlockingIOError:
                pass
    assert 850 < heard < 950


def test_an_overtaken_datagram_comes_next():
    with ends() as (wire, vehicle, driver):
        wire.swap = 0.3
        for number in range(200):
            driver.sendto(b"%03d" % number, vehicle.getsockname())
        came = [int(data) for data, _ in all_of(vehicle)]
    assert came != sorted(came) and set(range(199)) <= set(came)
    assert max(abs(number - place) for place, number in enumerate(came)) <= 1


def test_a_stranger_speaks_from_the_same_port_of_another_address():
    with ends() as (wire, vehicle, driver):
        vehicle.send(b"I stand")
        honest = all_of(driver)
        wire.repeat_as_stranger()
        wire.estranged = True
        vehicle.send(b"I fly")
        strange = all_of(driver)
        assert honest == [(b"I stand", vehicle.getsockname())]
        port = vehicle.getsockname()[1]
        assert strange == [(b"I stand", (STRANGER, port)), (b"I fly", (STRANGER, port))]
        assert wire.told_to_stranger() == 0
        driver.sendto(b"who are you?", (STRANGER, port))
        assert (wire.told_to_stranger(), wire.told_to_stranger()) == (1, 0)


def test_sockets_are_as_before_when_the_wire_is_left():
    before = [getattr(socket.socket, name) for name in ("send", "sendto", "recvfrom", "recvmsg_into")]
    with Wire(VEHICLE, STRANGER):
        assert socket.socket.sendto is not before[1]
    assert [getattr(socket.socket, name) for name in ("send", "sendto", "recvfrom", "recvmsg_into")] == before


def test_damage_is_of_many_kinds_and_repeatable():
    data = b"AT*REF=1,290718208\r"
    made = [damaged(data, random.Random(7)) for _ in range(2)]
    assert made[0] == made[1]
    draw = random.Random(1)
    lengths = {len(damaged(data, draw)) for _ in range(300)}
    assert min(lengths) < len(data) < max(lengths)
