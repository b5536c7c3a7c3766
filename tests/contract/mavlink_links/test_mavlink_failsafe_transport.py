"""Failsafe frames in place of a dead driver arrive on every kind of link: signed, called by the vehicle, serial."""

import dataclasses
import json
import os
import pty
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from drivers.mavlink.failsafe import heartbeat, hover_and_land
from drivers.mavlink.failsafe_transport import MavlinkFailsafe
from drivers.mavlink.links.opening import open_link
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.wire.flight import CommandLong, SetPositionTargetLocalNed
from drivers.mavlink.wire.frames import FrameDecoder, FrameEncoder, split
from drivers.mavlink.wire.signature import stamp_at
from drivers.mavlink.wire.telemetry import Heartbeat
from drivers.mavlink.wire.verification import Signing, Verifier
from groundstation.flight.composition import process_table
from groundstation.process.heartbeat import MOST_ADDRESSES, HeartbeatBlock
from groundstation.settings.load import load_field
from groundstation.supervisor.failsafe_sender import FailsafeSender, Speaker

FIELD = Path(__file__).parents[3] / "config" / "mixed-team.yaml"
KEY = bytes(range(32))
HEARTBEAT = Heartbeat(2, 3, 1, 4, 3)
S = 1_000_000_000


def words_of(tmp_path, **mavlink):
    """Return the failsafe frames of the mixed team's MAVLink drivers, for another address."""
    field = load_field(FIELD)
    for name, drone in field.drones.items():
        if drone.kind == "mavlink":
            other = drone.sections["mavlink"].model_copy(update=mavlink)
            field.drones[name] = drone.model_copy(update={"mavlink": other})
    table = process_table(field, "tcp/127.0.0.1:1", tmp_path, simulation=None, monitor=False)
    spoken = [s.failsafe_datagrams for s in table if s.failsafe_datagrams and s.failsafe_datagrams.hover[0] == 0xFD]
    return spoken, [d.model_dump()["mavlink"]["system_id"] for d in field.drones.values() if d.kind == "mavlink"]


@pytest.fixture
def key_file(tmp_path):
    path = tmp_path / "key"
    path.write_bytes(KEY)
    path.chmod(0o600)
    return str(path)


def target_of(frame):
    message: Any = FrameDecoder().decode(frame).message
    return message.target_system


def at(words, udp, **changes):
    return dataclasses.replace(words, address="127.0.0.1", port=udp.getsockname()[1], **changes)


@pytest.mark.parametrize("signed", [False, True])
def test_words_to_many_vehicles_fit_a_usual_network_unfragmented(vehicle, key_file, signed):
    """One lost fragment loses the whole datagram, and no vehicle would be stopped."""
    systems = list(range(1, 61))
    way = json.dumps({"serial": "", "key_file": key_file if signed else "", "interface": ""})
    transport = MavlinkFailsafe(way, 2)
    for words in hover_and_land(systems, signed=signed):
        transport.send(words, [vehicle.getsockname()])
        told: list[int] = []
        while len(told) < len(systems):
            datagram = vehicle.recv(65536)
            assert len(datagram) <= 1400
            told += [target_of(frame) for frame in split(datagram)]
        assert told == systems
    transport.close()


def test_a_signed_vehicle_obeys_driver_supervisor_and_guardian_in_any_order(vehicle, key_file, tmp_path):
    (words, *_), _ = words_of(tmp_path, key_file=key_file, link="pymavlink")
    words = at(words, vehicle, land_after_s=0.2)
    link = open_link(LinkSettings(target=f"udpout:127.0.0.1:{words.port}", key_file=key_file))
    speakers = [FailsafeSender(speaker) for speaker in Speaker]
    decoder, kinds = FrameDecoder(Signing(KEY, 0)), []
    for round_ in range(4):
        link.send(11, HEARTBEAT)
        for speaker in speakers:
            speaker.begin("px4", words, 0)
            speaker.send_due(round_ * S // 10)
        for _ in range(3):
            kinds += [type(decoder.decode(frame).message) for frame in split(vehicle.recv(2048))]
    link.close()
    for speaker in speakers:
        speaker.close()
    spoken = (SetPositionTargetLocalNed, SetPositionTargetLocalNed, CommandLong, CommandLong)
    assert kinds == [kind for word in spoken for kind in (Heartbeat, Heartbeat, word, Heartbeat, word)]


@pytest.mark.parametrize(
    ("flying", "restarted", "speaking"),
    [
        (-3600, -3600, -3600),  # clock set back in flight
        (3600, 3600, 3600),  # clock set forward, and the driver restarted since
        (3600, 0, 0),  # clock set forward and back
        (3600, 3600, 0),  # clock set forward, the driver restarted, the clock set back
    ],
)
def test_failsafe_frames_are_accepted_after_the_clock_was_set_in_flight(
    vehicle, key_file, tmp_path, monkeypatch, flying, restarted, speaking
):
    (words, *_), _ = words_of(tmp_path, key_file=key_file, link="pymavlink")
    words, real, verifier = at(words, vehicle), time.time, Verifier(Signing(KEY, 0))
    guardian, left = FailsafeSender(Speaker.GUARDIAN), 0
    assert not guardian.prepare("px4", words)
    target = LinkSettings(target=f"udpout:127.0.0.1:{words.port}", key_file=key_file)
    for seconds in (0, flying), (restarted, restarted):
        monkeypatch.setattr(time, "time", lambda seconds=seconds: real() + seconds[0])
        link = open_link(target)
        monkeypatch.setattr(time, "time", lambda seconds=seconds: real() + seconds[1])
        for _ in range(3):
            link.send(11, HEARTBEAT)
            heard = vehicle.recv(2048)
            # A vehicle accepts a restarted driver once that driver has received a frame of it: see the separate test.
            if int.from_bytes(heard[-12:-6], "little") > verifier.newest:
                verifier.verify(heard)
                left = link.newest_stamp
        link.close()
    monkeypatch.setattr(time, "time", lambda: real() + speaking)
    guardian.begin("px4", words, 0, left=lambda: left)
    guardian.send_due(S)
    for frame in split(vehicle.recv(2048)):
        verifier.verify(frame)
    guardian.close()


def test_failsafe_frames_are_accepted_although_the_computers_clock_is_slow(vehicle, port, key_file, tmp_path):
    """The vehicle knows the time of another ground station, which flew it before; the driver has received that time."""
    (words, *_), _ = words_of(tmp_path, key_file=key_file, link="pymavlink")
    ahead = stamp_at(time.time()) + 360_000_000
    verifier = Verifier(Signing(KEY, ahead))
    link = open_link(LinkSettings(target=f"udpin:127.0.0.1:{port}", key_file=key_file))
    vehicle.sendto(FrameEncoder(11, 1, Signing(KEY, ahead)).encode(HEARTBEAT), ("127.0.0.1", port))
    assert link.receive() and link.newest_stamp >= ahead
    guardian = FailsafeSender(Speaker.GUARDIAN)
    guardian.begin("px4", at(words, vehicle), 0, left=lambda: link.newest_stamp)
    guardian.send_due(S)
    for frame in split(vehicle.recv(2048)):
        verifier.verify(frame)
    guardian.close()
    link.close()


def test_the_driver_leaves_its_time_to_who_speaks_after_it(key_file, tmp_path):
    block = HeartbeatBlock.create(f"test-left-{os.getpid()}", 2)
    stamp = stamp_at(time.time())
    block.leave(1, stamp)
    block.clear(1)
    assert block.left(1) == stamp and block.left(0) == 0
    block.close(remove=True)
    link = open_link(LinkSettings(target="udpin:127.0.0.1:0"))
    assert link.newest_stamp == 0, "an unsigned link has no time"
    link.close()


def test_a_driver_that_comes_back_is_heard_after_the_guardian(vehicle, key_file, tmp_path):
    (words, *_), _ = words_of(tmp_path, key_file=key_file, link="pymavlink")
    verifier = Verifier(Signing(KEY, 0))
    words = at(words, vehicle)
    guardian = FailsafeSender(Speaker.GUARDIAN)
    guardian.begin("px4", words, 0)
    for turn in range(20):
        guardian.send_due(turn * S // 10)
        for frame in split(vehicle.recv(2048)):
            verifier.verify(frame)
    guardian.close()
    link = open_link(LinkSettings(target=f"udpout:127.0.0.1:{words.port}", key_file=key_file))
    link.send(11, HEARTBEAT)
    verifier.verify(vehicle.recv(2048))
    link.close()


def test_a_key_that_cannot_be_read_is_named_and_never_sent_unsigned(vehicle, key_file, tmp_path):
    (words, *_), _ = words_of(tmp_path, key_file=key_file, link="pymavlink")
    Path(key_file).write_bytes(b"short")
    sender = FailsafeSender()
    assert "32 bytes" in sender.prepare("px4", at(words, vehicle))
    assert sender.begin("px4", at(words, vehicle), 0)
    sender.send_due(S)
    vehicle.setblocking(False)
    with pytest.raises(BlockingIOError):
        vehicle.recv(2048)


def test_vehicles_that_call_one_port_are_all_spoken_to_where_they_were_heard(vehicle, tmp_path):
    spoken, systems = words_of(tmp_path, listen=True, port=14_777, local_address="127.0.0.1")
    (words,) = spoken
    assert words.called and len(systems) > 1
    targets = [target_of(frame) for frame in split(words.land)]
    assert targets == systems
    sender = FailsafeSender()
    sender.begin("px4", words, 0, lambda: (vehicle.getsockname(),))
    sender.send_due(S)
    beat, *frames = split(vehicle.recv(2048))
    assert beat == heartbeat() and [target_of(frame) for frame in frames] == systems
    sender.close()


def test_where_vehicles_called_from_outlives_their_driver(vehicle, port):
    link = open_link(LinkSettings(target=f"udpin:127.0.0.1:{port}"))
    vehicle.sendto(FrameEncoder(11, 1).encode(HEARTBEAT), ("127.0.0.1", port))
    assert not link.called_from
    link.receive()
    assert list(link.called_from) == [vehicle.getsockname()]
    link.close()
    block = HeartbeatBlock.create(f"test-transport-{os.getpid()}", 3)
    block.set_addresses(1, link.called_from)
    block.beat(1)
    block.clear(1)
    assert block.addresses(1) == (vehicle.getsockname(),)
    assert block.addresses(0) == block.addresses(2) == ()
    assert MOST_ADDRESSES >= 30, "each vehicle of a large team that calls one port is to be stopped"
    many = [("255.255.255.254", 65_535 - index) for index in range(MOST_ADDRESSES + 1)]
    block.set_addresses(2, many)
    assert block.addresses(2) == tuple(many[:-1])
    block.close(remove=True)


@pytest.mark.parametrize("signed", [False, True])
def test_a_line_is_spoken_on_beside_a_driver_that_hangs(key_file, tmp_path, signed):
    vehicle, line = pty.openpty()
    device = os.ttyname(line)
    (words, *_), _ = words_of(tmp_path, serial=f"{device}:57600", key_file=key_file * signed, link="pymavlink")
    hangs = open_link(LinkSettings(target=f"serial:{device}:57600", key_file=key_file * signed))
    sender = FailsafeSender(Speaker.GUARDIAN)
    sender.begin("px4", dataclasses.replace(words, land_after_s=0.5), 0)
    decoder = FrameDecoder(Signing(KEY, 0) if signed else None)
    for now_s, kind in ((0.0, SetPositionTargetLocalNed), (1.0, CommandLong)):
        sender.send_due(int(now_s * S))
        time.sleep(0.02)
        heard = [type(decoder.decode(frame).message) for frame in split(os.read(vehicle, 4096))]
        assert heard == [Heartbeat, kind]
    sender.close()
    hangs.close()
    for fd in (vehicle, line):
        os.close(fd)


def test_an_emulated_signed_vehicle_lands_at_the_guardians_word(hangar, key_file, tmp_path):
    (words, *_), systems = words_of(tmp_path, key_file=key_file, link="pymavlink")
    emulator, _, (address, port) = hangar.add("px4", systems[0], signing=Signing(KEY, 0))
    heard = []
    obey = emulator.firmware.land

    def land():
        heard.append("land")
        return obey()

    emulator.firmware.land = land
    sender = FailsafeSender(Speaker.GUARDIAN)
    sender.begin("px4", dataclasses.replace(words, address=address, port=port, land_after_s=0.0), 0)
    deadline = time.monotonic() + 3
    while not heard and time.monotonic() < deadline:
        sender.send_due(time.monotonic_ns())
        time.sleep(0.02)
    sender.close()
    assert heard and not emulator.rejected


def test_the_guardians_transport_needs_no_dialect():
    code = (
        "import sys, drivers.mavlink.failsafe_transport; "
        "sys.exit(any(name.startswith('pymavlink') for name in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=20).returncode == 0
