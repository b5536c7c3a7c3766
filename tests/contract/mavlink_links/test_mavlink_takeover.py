"""Unverified frames can neither take over a vehicle's address nor count as its sign of life."""

import socket
import time
from contextlib import ExitStack
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.links.udp import UdpLink
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.wire.flight import CommandLong
from drivers.mavlink.wire.frames import FrameDecoder, FrameEncoder
from drivers.mavlink.wire.names import MavCmd
from drivers.mavlink.wire.telemetry import Heartbeat
from drivers.mavlink.wire.verification import Signing

KEY, STAMP = bytes(range(32)), 30_000_000_000_000
HELD_NS = 50_000_000
LAND = CommandLong(11, 1, MavCmd.NAV_LAND, 0)
BEAT = Heartbeat(2, 3, 1, 4, 3)

HEAD = bytes((0xFD, 1, 0, 0, 9, 11, 1))
UNKNOWN = HEAD + b"\xff\xff\x00" + b"abc"  # 13 bytes of kind 65535
UNUSED = HEAD + (24).to_bytes(3, "little") + b"\1"  # GPS_RAW_INT, to be given a checksum
WRONG_SUM = UNUSED + b"\0\0"
RIGHT_SUM = UNUSED + dialect.x25crc(UNUSED[1:] + bytes([24])).crc.to_bytes(2, "little")
FORGED = FrameEncoder(11, 1, Signing(bytes(32), STAMP + 10**6)).encode(BEAT)


@pytest.fixture
def scene(monkeypatch):
    """The vehicle, the attacker, and our port's opener; addresses are held for 0.05 s only."""
    monkeypatch.setattr("drivers.mavlink.links.udp._ADDRESS_HELD_NS", HELD_NS)
    with ExitStack() as stack:
        sockets = []
        for _ in range(2):
            udp = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            udp.bind(("127.0.0.1", 0))
            udp.settimeout(1.0)
            sockets.append(udp)

        def open_port(signing, port, sniffed):
            link = UdpLink(LinkSettings(target=f"udpin:127.0.0.1:{port}"), signing, lambda *what: sniffed.append(what))
            stack.callback(link.close)
            return link

        yield *sockets, open_port


@pytest.mark.parametrize(
    ("signing", "sent", "reason"),
    [
        (Signing(KEY, STAMP), UNKNOWN, "unsigned"),
        (Signing(KEY, STAMP), RIGHT_SUM, "unsigned"),
        (Signing(KEY, STAMP), FrameEncoder(11, 1).encode(BEAT), "unsigned"),
        (Signing(KEY, STAMP), FORGED, "signature"),
        (None, UNKNOWN, "unknown_kind"),
        (None, WRONG_SUM, "checksum"),
    ],
    ids=["signed: 13 bytes", "signed: unused", "signed: plain", "signed: forged", "plain: 13 bytes", "plain: unused"],
)
def test_land_goes_to_the_vehicle_and_not_to_who_spoke_after_its_silence(scene, port, signing, sent, reason):
    vehicle, attacker, open_port = scene
    sniffed: list[Any] = []
    link = open_port(signing, port, sniffed)
    vehicle.sendto(FrameEncoder(11, 1, signing).encode(BEAT), ("127.0.0.1", port))
    assert [heard.frame.message for heard in link.receive()] == [BEAT]
    time.sleep(2 * HELD_NS / 1e9)
    attacker.sendto(sent, ("127.0.0.1", port))
    assert link.receive() == []
    assert link.rejected == {reason: 1}
    assert len(sniffed) == 1, "what is refused is not recorded as said by the vehicle"
    link.send(11, LAND)
    assert FrameDecoder(signing).decode(vehicle.recv(2048)).message == LAND
    attacker.setblocking(False)
    with pytest.raises(BlockingIOError):
        attacker.recv(2048)


def test_a_vehicle_that_was_never_verified_has_no_address(scene, port):
    _, attacker, open_port = scene
    link = open_port(Signing(KEY, STAMP), port, [])
    attacker.sendto(UNKNOWN, ("127.0.0.1", port))
    assert link.receive() == []
    link.send(11, LAND)
    attacker.setblocking(False)
    with pytest.raises(BlockingIOError):
        attacker.recv(2048)
