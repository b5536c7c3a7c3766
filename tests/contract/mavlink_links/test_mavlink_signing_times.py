"""Signing timestamps: monotonic, continued from those of the vehicles, and sent to a vehicle with an old time."""

import os
import pty
import socket
import time
import tty

import pytest
from free_port import free_port

from drivers.mavlink.links.seam import Heard
from drivers.mavlink.links.serial import SerialLink
from drivers.mavlink.links.udp import UdpLink
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.signing_clock import SigningClock
from drivers.mavlink.wire.frames import FrameDecoder, FrameEncoder
from drivers.mavlink.wire.signature import SIGNATURE, stamp_at
from drivers.mavlink.wire.telemetry import Heartbeat
from drivers.mavlink.wire.verification import Signing

KEY = bytes(range(32))
HOUR, MINUTE, SECOND = 360_000_000, 6_000_000, 100_000  # [10 us]
BEAT, OURS = Heartbeat(2, 3, 1, 4, 3), Heartbeat(6, 8, 0, 0, 4)


def stamp_of(frame):
    return int.from_bytes(frame[-SIGNATURE + 1 : -6], "little")


def heard_by(link, count=1):
    deadline, heard = time.monotonic() + 2.0, list[Heard]()
    while len(heard) < count and time.monotonic() < deadline:
        heard += link.receive()
    return [one.frame.message for one in heard]


@pytest.fixture
def now():
    return stamp_at(time.time())


def test_a_vehicle_that_calls_with_an_old_time_is_told_ours_and_heard_then(vehicle, now):
    port = free_port(kind=socket.SOCK_DGRAM)
    link = UdpLink(LinkSettings(target=f"udpin:127.0.0.1:{port}"), Signing(KEY, now))
    encoder = FrameEncoder(11, 1, Signing(KEY, now - 24 * HOUR))  # it was switched off over night
    vehicle.sendto(encoder.encode(BEAT), ("127.0.0.1", port))
    assert heard_by(link, 0) == [] and link.receive() == [] and link.rejected == {"replayed": 1}
    greeting = vehicle.recv(300)
    assert FrameDecoder(Signing(KEY, now - 24 * HOUR)).decode(greeting).system == 255
    vehicle.sendto(encoder.encode(BEAT, not_before=stamp_of(greeting)), ("127.0.0.1", port))
    assert heard_by(link) == [BEAT]
    link.close()


def test_wrongly_signed_messages_are_not_greeted(vehicle, now):
    port = free_port(kind=socket.SOCK_DGRAM)
    link = UdpLink(LinkSettings(target=f"udpin:127.0.0.1:{port}"), Signing(KEY, now))
    vehicle.sendto(FrameEncoder(11, 1, Signing(bytes(32), now - 24 * HOUR)).encode(BEAT), ("127.0.0.1", port))
    assert link.receive() == [] and link.rejected == {"signature": 1}
    vehicle.settimeout(0.1)
    with pytest.raises(TimeoutError):
        vehicle.recv(300)
    link.close()


def test_our_times_go_on_from_what_a_vehicle_knows(vehicle, now):
    """Another ground station gave it a newer time, or our clock is slow: it ignores frames with an older time."""
    port = free_port(kind=socket.SOCK_DGRAM)
    link = UdpLink(LinkSettings(target=f"udpin:127.0.0.1:{port}"), Signing(KEY, now))
    told = FrameEncoder(11, 1, Signing(KEY, now + 2 * HOUR)).encode(BEAT)
    vehicle.sendto(told, ("127.0.0.1", port))
    assert heard_by(link) == [BEAT]
    link.send(11, OURS)
    assert stamp_of(vehicle.recv(300)) > stamp_of(told)
    link.close()


def test_a_clock_that_is_set_in_flight_moves_our_times_by_nothing(vehicle, now, monkeypatch):
    """A failsafe sender signs by the same clock, and does not know the driver's last timestamp."""
    link = UdpLink(LinkSettings(target=f"udpout:127.0.0.1:{vehicle.getsockname()[1]}"), Signing(KEY, now))
    real, stamps = time.time, []
    for hours in (0, 1, 1, -1):
        monkeypatch.setattr(time, "time", lambda hours=hours: real() + 3600 * hours)
        link.send(11, OURS)
        stamps.append(stamp_of(vehicle.recv(300)))
    assert stamps == sorted(set(stamps))
    assert stamps == pytest.approx([now] * 4, abs=10 * SECOND)
    link.close()


def test_our_times_go_on_while_nothing_is_sent(monkeypatch):
    clock, real = SigningClock(), time.clock_gettime
    began = clock.stamp()
    monkeypatch.setattr(time, "clock_gettime", lambda which: real(which) + 3600.0)
    assert clock.stamp() - began == pytest.approx(HOUR, abs=10 * SECOND)


def test_a_clock_that_was_never_set_signs_with_nothing(monkeypatch):
    monkeypatch.setattr(time, "time", lambda: 60.0)
    assert SigningClock().stamp() == 0


def test_a_line_signs_with_the_time_as_well(now):
    radio, line = pty.openpty()
    tty.setraw(line)
    link = SerialLink(LinkSettings(target=f"serial:{os.ttyname(line)}:57600"), Signing(KEY, now - HOUR))
    link.send(11, OURS)
    assert stamp_of(os.read(radio, 300)) == pytest.approx(now, abs=10 * SECOND)
    told = FrameEncoder(11, 1, Signing(KEY, now + 2 * HOUR)).encode(BEAT)
    os.write(radio, told)
    assert heard_by(link) == [BEAT]
    link.send(11, OURS)
    assert stamp_of(os.read(radio, 300)) > stamp_of(told)
    link.close()
    os.close(radio)
    os.close(line)


def test_frames_without_a_key_carry_no_time():
    assert FrameEncoder(11, 1).encode(BEAT, not_before=7) == FrameEncoder(11, 1).encode(BEAT)
