"""Two clients of one emulated autopilot, through pymavlink: rates, sequence numbers and version of each."""

import os
import time
from collections import Counter
from contextlib import contextmanager
from itertools import pairwise

import pytest

os.environ.setdefault("MAVLINK20", "1")
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as dialect

FRESH_S = 0.3


class Client:
    """A ground station. old: it sends MAVLink 1; frames: (version, sequence, message) as they came."""

    def __init__(self, address, system, old=False):
        self.link = mavutil.mavlink_connection(
            f"udpout:{address[0]}:{address[1]}", source_system=system, dialect="ardupilotmega"
        )
        self.old, self.frames = old, []
        self.mav = dialect.MAVLink(None, srcSystem=system, srcComponent=190)
        self.parser = dialect.MAVLink(None)

    def send(self, message):
        self.link.port.sendto(message.pack(self.mav, force_mavlink1=self.old), self.link.destination_addr)
        self.mav.seq = (self.mav.seq + 1) % 256

    def beat(self):
        self.send(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))

    def rate(self, number, hz):
        self.send(dialect.MAVLink_command_long_message(5, 1, 511, 0, number, 1e6 / hz if hz else -1, 0, 0, 0, 0, 0))

    def listen(self, seconds):
        """Return the names of what came, with their numbers."""
        self.frames.clear()
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            data = self.link.recv(2048)
            if not data:
                time.sleep(0.002)
            for message in self.parser.parse_buffer(data) or [] if data else []:
                buffer = message.get_msgbuf()
                sequence = buffer[4] if buffer[0] == 0xFD else buffer[2]
                self.frames.append((buffer[0], sequence, message))
        return Counter(message.get_type() for _, _, message in self.frames)

    def versions(self):
        return {version for version, _, _ in self.frames}


@contextmanager
def clients(*made):
    try:
        yield made
    finally:
        for one in made:
            one.link.close()


def heard_in_a_second(*both):
    """Return what came to each of two clients in the same time, once their last orders have had effect."""
    for client in (*both, *both):
        client.listen(FRESH_S / 2)
    heard: list[Counter[str]] = [Counter() for _ in both]
    end = time.monotonic() + 1.0
    while time.monotonic() < end:  # by turns: a socket holds less than a second of a PX4
        for client, one in zip(both, heard, strict=True):
            one.update(client.listen(0.02))
    return heard


@pytest.fixture(params=["px4", "ardupilot"])
def address(request, hangar):
    return hangar.add(request.param, 5)[2]


def test_rates_are_those_of_the_client_that_asked(address):
    with clients(Client(address, 255), Client(address, 254)) as (fast, slow):
        for client in (fast, slow):
            client.beat()
        for number in (30, 31):
            fast.rate(number, 20)
            slow.rate(number, 5)
        often, seldom = heard_in_a_second(fast, slow)
        for name in ("ATTITUDE", "ATTITUDE_QUATERNION"):
            assert 3 <= seldom[name] <= 8 and often[name] >= 3 * seldom[name]
        slow.rate(30, 0)
        often, seldom = heard_in_a_second(fast, slow)
        assert "ATTITUDE" not in seldom and often["ATTITUDE"] > 10


def test_each_clients_sequence_has_no_holes(address):
    with clients(Client(address, 255), Client(address, 254)) as both:
        for client in both:
            client.beat()
            client.rate(30, 50)
            client.rate(31, 10 if client is both[0] else 40)
        for client in both:
            client.listen(0.8)
            numbers = [sequence for _, sequence, _ in client.frames]
            assert len(numbers) > 30
            assert all((after - before) % 256 == 1 for before, after in pairwise(numbers))


def test_a_client_that_speaks_the_old_version_is_answered_in_it(address):
    with clients(Client(address, 255, old=True), Client(address, 254)) as (old, new):
        for client in (old, new):
            client.beat()
            client.rate(30, 20)
            client.rate(331, 20)  # ODOMETRY, which MAVLink 1 has no number for
        came = old.listen(1.0)
        new.listen(0.05)
        assert old.versions() == {0xFE} and new.versions() == {0xFD}
        assert came["COMMAND_ACK"] == 2 and came["HEARTBEAT"] and came["ATTITUDE"] > 10
        assert "ODOMETRY" not in came
        old.old = False
        old.beat()
        old.listen(FRESH_S)
        old.listen(0.3)
        assert old.versions() == {0xFD}
        old.old = True
        old.beat()
        old.listen(FRESH_S)
        old.listen(0.3)
        assert old.versions() == {0xFD}, "the version that once was understood stays"


def test_a_list_of_parameters_goes_to_the_client_that_asked(address):
    with clients(Client(address, 255), Client(address, 254)) as (asking, other):
        for client in (asking, other):
            client.beat()
        asking.send(dialect.MAVLink_param_request_list_message(5, 1))
        values = asking.listen(0.6)["PARAM_VALUE"]
        assert values > 20 and not other.listen(0.05)["PARAM_VALUE"]


def test_rates_outlast_a_pause_of_the_client(hangar):
    emulator, _, address = hangar.add("ardupilot", 5)
    with clients(Client(address, 255)) as (client,):
        client.beat()
        client.rate(30, 20)
        assert client.listen(0.5)["ATTITUDE"]
        (channel,) = emulator._clients.values()
        with hangar.lock:
            channel.heard_ns -= 11_000_000_000
        client.listen(FRESH_S)
        assert not client.listen(0.3)
        client.beat()
        came = client.listen(0.5)
        assert came["ATTITUDE"] > 5 and came["HEARTBEAT"]
