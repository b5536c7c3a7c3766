"""A NatNet system that is given by the name of its host: found, looked up again, and told where there is none."""

import socket
import time
from contextlib import suppress
from threading import Event

import pytest

from drivers.motion_capture.settings import parse_source
from drivers.motion_capture.sources import NatnetSource
from drivers.motion_capture.wire import natnet

HOST = "127.0.0.1"


def polled(source: NatnetSource, until, within_s: float = 5.0) -> None:
    """Poll a source until a condition holds."""
    deadline = time.monotonic() + within_s
    while not until() and time.monotonic() < deadline:
        source.poll(0.01)
    assert until()


def test_a_system_is_found_by_the_name_of_its_host() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as system:
        system.bind((HOST, 0))
        system.settimeout(0.0)
        source = NatnetSource(parse_source(f"natnet://localhost:{system.getsockname()[1]}"))
        answered = []

        def answers() -> bool:
            with suppress(OSError):
                server = natnet.encode_server(natnet.Server("Motive", (4, 1), 10**6, 1511, ""))
                answered.append(system.sendto(server, system.recvfrom(2048)[1]))
            return bool(answered) and source.detail == ""

        polled(source, answers)
        assert not source.rejected
        source.close()


def test_a_name_without_an_address_is_told_blocks_nothing_and_is_looked_up_again(monkeypatch) -> None:
    errors, released = [OSError(1, "Name or service not known")], [Event(), Event()]

    def looked_up(host, *_):
        assert host == "motive-pc"
        released[0 if errors else 1].wait(10.0)
        if errors:
            raise errors.pop()
        return [(0, 0, 0, "", ("127.0.0.1", 0)), (0, 0, 0, "", ("127.0.0.2", 0))]

    monkeypatch.setattr("drivers.host_lookup.socket.getaddrinfo", looked_up)
    monkeypatch.setattr("drivers.motion_capture.sources._LOOK_UP_AGAIN_NS", 0)
    source = NatnetSource(parse_source("natnet://motive-pc"))
    began = time.monotonic()
    assert source.poll(0.0) == [] and source.detail == "no answer from motive-pc:1510"
    assert time.monotonic() - began < 1.0
    released[0].set()
    polled(source, lambda: source.detail.endswith("for the name motive-pc: Name or service not known"))
    released[1].set()
    polled(source, lambda: source.detail == "no answer from motive-pc:1510")
    source.close()


@pytest.mark.parametrize("host", ["a..b", "x" * 64, "[::1]"])
def test_a_host_that_is_no_name_is_told(host: str) -> None:
    source = NatnetSource(parse_source(f"natnet://{host}"))
    polled(source, lambda: source.detail.startswith("no IPv4 address is known for the name"))
    source.close()
