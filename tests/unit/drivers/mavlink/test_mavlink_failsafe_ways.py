"""The failsafe sender with a broken or full serial line, with a network adapter, and for many vehicles."""

import json
import os
import pty
import socket
import time
from contextlib import suppress
from pathlib import Path

import pytest

from drivers.mavlink.failsafe import heartbeat
from drivers.mavlink.failsafe_transport import MavlinkFailsafe
from groundstation.errors import DriverError


def frame(payload: int) -> bytes:
    """Return an unsigned frame of 12 bytes and so many more."""
    return bytes([0xFD, payload, *[0] * 8]) + bytes(payload + 2)


def way(serial: str = "", interface: str = "") -> str:
    return json.dumps({"serial": serial, "key_file": "", "interface": interface})


def descriptors() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


@pytest.fixture
def device(tmp_path):
    """A folder in which serial lines can be plugged in."""
    ends: list[int] = []

    def plug() -> int:
        end, line = pty.openpty()
        ends.extend((end, line))
        path = tmp_path / "line"
        path.unlink(missing_ok=True)
        path.symlink_to(os.ttyname(line))
        return end

    yield str(tmp_path / "line"), plug
    for end in ends:
        with suppress(OSError):
            os.close(end)


def test_a_line_that_fails_is_opened_anew_once_it_is_there_again(device):
    path, plug = device
    transport, end = MavlinkFailsafe(way(f"{path}:57600"), 2), plug()
    transport.send(frame(1), [])
    assert os.read(end, 64) == frame(1)
    before = descriptors()
    os.close(end)
    with pytest.raises(OSError):
        transport.send(frame(1), [])
    assert descriptors() == before - 2, "its end, and its own"
    Path(path).unlink()
    with pytest.raises(OSError, match="cannot open"):
        transport.send(frame(1), [])
    end = plug()
    transport.send(frame(2), [])
    assert os.read(end, 64) == frame(2)
    transport.close()


def test_a_line_that_is_full_is_kept(device):
    path, plug = device
    transport, end = MavlinkFailsafe(way(f"{path}:57600"), 2), plug()
    with pytest.raises(BlockingIOError):
        for _ in range(1000):
            transport.send(frame(200), [])
    before, heard = descriptors(), b""
    deadline = time.monotonic() + 5.0
    while not heard.endswith(frame(9)) and time.monotonic() < deadline:
        heard = os.read(end, 65_536)
        with suppress(BlockingIOError):
            transport.send(frame(9), [])
    assert heard.endswith(frame(9))
    assert descriptors() == before
    transport.close()


def test_a_line_is_closed_once(device):
    path, plug = device
    plug()
    transport, before = MavlinkFailsafe(way(f"{path}:57600"), 2), descriptors()
    transport.send(frame(1), [])
    transport.close()
    transport.close()
    assert descriptors() == before
    os.fstat(0)


def test_a_transport_waits_for_no_network_and_keeps_to_its_adapter():
    transport = MavlinkFailsafe(way(interface="lo"), 2)
    assert transport._socket is not None and not transport._socket.getblocking()
    assert transport._socket.getsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, 16).startswith(b"lo\0")
    transport.close()
    with pytest.raises(DriverError, match="interface"):
        MavlinkFailsafe(way(interface="no-such-adapter"), 2)


@pytest.mark.parametrize(
    ("payloads", "sizes"),
    [([255] * 4 + [120], [1200]), ([255] * 4 + [121], [1068, 133]), ([255] * 9, [1068, 1068, 267])],
    ids=["as much as fits", "a byte more", "twice as much and more"],
)
def test_as_many_whole_frames_go_together_as_fit_in_a_usual_network(payloads, sizes):
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    udp.bind(("127.0.0.1", 0))
    udp.settimeout(2.0)
    transport = MavlinkFailsafe(way(), 2)
    transport.send(b"", [udp.getsockname()])
    transport.send(b"".join(map(frame, payloads)), [udp.getsockname()])
    assert [len(udp.recv(4096)) for _ in sizes] == sizes
    transport.close()
    udp.close()


def test_a_heartbeat_comes_first_for_three_seconds_of_each_spell(monkeypatch):
    """Without one an ArduPilot pauses the landing that it began; one that does not obey must miss them soon."""
    transport, now_s = (
        MavlinkFailsafe(json.dumps({"serial": "", "key_file": "", "heartbeat": frame(9).hex()}), 2),
        [0.0],
    )
    monkeypatch.setattr("drivers.mavlink.failsafe_transport.time.monotonic", lambda: now_s[0])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
        vehicle.bind(("127.0.0.1", 0))
        vehicle.settimeout(2.0)
        for at_s, expected in ((10.0, 9), (10.7, 9), (11.4, 9), (12.1, 9), (12.9, 9), (13.1, 1), (13.9, 1), (20.0, 9)):
            now_s[0] = at_s
            transport.send(frame(1), [vehicle.getsockname()])
            assert vehicle.recv(64)[1] == expected
    transport.close()


def test_supervisor_and_guardian_are_given_the_drivers_heartbeat():
    signed = heartbeat(signed=True)
    assert len(signed) == len(heartbeat()) + 13 and signed[7] == 0, "the number of HEARTBEAT"
    assert heartbeat()[5:7] == bytes((255, 190)), "the ids that its vehicles count"
