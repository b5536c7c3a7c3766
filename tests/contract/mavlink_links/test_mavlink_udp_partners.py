"""UDP links to one lasting partner, and autopilots that speak MAVLink 1 until they receive version 2."""

import socket
import time

import pytest
from free_port import free_port
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.links.udp import UdpLink
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.wire.frames import FrameEncoder
from drivers.mavlink.wire.telemetry import AttitudeQuaternion, Heartbeat
from drivers.mavlink.wire.verification import Signing


def test_a_link_that_is_opened_again_speaks_from_the_same_port(vehicle):
    sources = []
    for _ in range(2):
        link = UdpLink(LinkSettings(target=f"udpout:127.0.0.1:{vehicle.getsockname()[1]}"))
        link.send(1, Heartbeat(6, 8, 0, 0, 4))
        sources.append(vehicle.recvfrom(300)[1])
        link.close()
    assert sources[0] == sources[1]


def test_a_second_link_to_the_same_vehicle_is_opened_all_the_same(vehicle):
    settings = LinkSettings(target=f"udpout:127.0.0.1:{vehicle.getsockname()[1]}")
    first, second = UdpLink(settings), UdpLink(settings)
    for link in (first, second):
        link.send(1, Heartbeat(6, 8, 0, 0, 4))
    assert vehicle.recvfrom(300)[1] != vehicle.recvfrom(300)[1]
    first.close()
    second.close()


def test_mavlink_1_frames_are_refused_but_answered_once_a_second(vehicle):
    port = free_port(kind=socket.SOCK_DGRAM)
    link = UdpLink(LinkSettings(target=f"udpin:127.0.0.1:{port}"))
    old = dialect.MAVLink(None, 1, 1)
    frame = dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3).pack(old, force_mavlink1=True)
    for _ in range(3):
        vehicle.sendto(frame, ("127.0.0.1", port))
    deadline, heard = time.monotonic() + 1.0, []
    while link.rejected["mavlink_1"] < 3 and time.monotonic() < deadline:
        heard += link.receive()
    assert heard == [] and link.rejected["mavlink_1"] == 3
    assert vehicle.recvfrom(300)[0][0] == 0xFD
    vehicle.settimeout(0.1)
    with pytest.raises(TimeoutError):
        vehicle.recvfrom(300)
    link.send(1, Heartbeat(6, 8, 0, 0, 4))  # its address is not known yet
    with pytest.raises(TimeoutError):
        vehicle.recvfrom(300)
    link.close()


def test_frames_of_mavlink_1_are_recorded_and_those_of_strangers_are_not(vehicle):
    port = free_port(kind=socket.SOCK_DGRAM)
    noted = []
    sniffer = lambda system, stamp_ns, raw, received: noted.append((system, raw)) if received else None  # noqa: E731
    link = UdpLink(LinkSettings(target=f"udpin:127.0.0.1:{port}"), sniffer=sniffer)
    heartbeat = dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3)
    old = heartbeat.pack(dialect.MAVLink(None, 7, 1), force_mavlink1=True)
    new = heartbeat.pack(dialect.MAVLink(None, 7, 1))
    damaged = bytes(old[:-1]) + bytes([old[-1] ^ 1])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for sender, data in ((vehicle, old), (vehicle, damaged), (vehicle, new), (stranger, old), (vehicle, old)):
            sender.sendto(data, ("127.0.0.1", port))
            link.receive()
    assert noted == [(7, bytes(old)), (7, bytes(new)), (7, bytes(old))]
    assert link.rejected["mavlink_1"] == 4
    link.close()


def test_a_frame_of_mavlink_2_is_heard_behind_one_of_mavlink_1_in_one_datagram(vehicle):
    """A router gathers frames of several senders; a gimbal's may be of MAVLink 1."""
    port = free_port(kind=socket.SOCK_DGRAM)
    link = UdpLink(LinkSettings(target=f"udpin:127.0.0.1:{port}"))
    heartbeat = dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3)
    gimbal = dialect.MAVLink_heartbeat_message(26, 8, 0, 0, 4, 3).pack(dialect.MAVLink(None, 7, 154), True)
    vehicle.sendto(gimbal + heartbeat.pack(dialect.MAVLink(None, 7, 1)) + gimbal, ("127.0.0.1", port))
    assert [one.frame.system for one in link.receive()] == [7]
    assert link.rejected == {"mavlink_1": 2}
    link.close()


def stream(*numbers: int, signing: Signing | None = None) -> bytes:
    """Attitudes of one vehicle as they leave its serial port."""
    encoder = FrameEncoder(7, 1, signing)
    return b"".join(encoder.encode(AttitudeQuaternion(n, 1.0, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1)) for n in numbers)


def heard_of(link: UdpLink, vehicle: socket.socket, port: int, data: bytes, size: int = 128) -> list[int]:
    found = []
    for begin in range(0, len(data), size):
        vehicle.sendto(data[begin : begin + size], ("127.0.0.1", port))
        messages = [one.frame.message for one in link.receive()]
        found += [message.time_boot_ms for message in messages if isinstance(message, AttitudeQuaternion)]
    return found


def test_no_frame_is_lost_behind_a_serial_bridge_that_cuts_frames(vehicle):
    port = free_port(kind=socket.SOCK_DGRAM)
    link = UdpLink(LinkSettings(target=f"udpin:127.0.0.1:{port}"))
    assert heard_of(link, vehicle, port, stream(*range(50))) == list(range(50))
    assert not link.rejected
    link.close()


def test_a_signed_link_refuses_frames_of_two_datagrams_by_the_same_rules(vehicle):
    port = free_port(kind=socket.SOCK_DGRAM)
    key, other = (Signing(bytes([byte]) * 32, 10**6) for byte in (1, 2))
    link = UdpLink(LinkSettings(target=f"udpin:127.0.0.1:{port}"), signing=key)
    genuine = stream(*range(20), signing=key)
    assert heard_of(link, vehicle, port, genuine) == list(range(20))
    assert heard_of(link, vehicle, port, genuine) == heard_of(link, vehicle, port, stream(*range(20))) == []
    assert heard_of(link, vehicle, port, stream(*range(20), signing=other)) == []
    assert link.rejected == {"replayed": 20, "unsigned": 20, "signature": 20}
    link.close()


def test_a_stranger_neither_completes_nor_hides_a_frame(vehicle):
    """He sends the second half of a frame to both kinds of link, and the beginning of one that never ends."""
    frame = stream(1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.bind(("127.0.0.1", 0))
        port = free_port(kind=socket.SOCK_DGRAM)
        link = UdpLink(LinkSettings(target=f"udpin:127.0.0.1:{port}"))
        for sender, data in ((vehicle, frame[:20]), (stranger, frame[20:]), (stranger, b"\xfd\xff\x00")):
            sender.sendto(data, ("127.0.0.1", port))
            assert link.receive() == []
        assert heard_of(link, vehicle, port, frame[20:]) == [1]
        link.close()
    out = UdpLink(LinkSettings(target="udpout:127.0.0.2:5"))
    assert out._judge(0, frame[:20], ("127.0.0.7", 5)) == out._judge(0, frame[20:], ("127.0.0.2", 5)) == []
    out.close()
