"""`groundstation mavlink probe` and `setup` against emulated vehicles on loopback; refusals name the link."""

import os
import socket
import threading
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from pymavlink import mavutil

from drivers.camera.sources.opening import open_source
from drivers.mavlink.links.opening import open_link, signing_of
from drivers.mavlink.links.seam import Heard
from drivers.mavlink.links.udp import UdpLink
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.wire import telemetry
from drivers.mavlink.wire.frames import FrameEncoder
from drivers.mavlink.wire.verification import Signing
from groundstation.cli.mavlink import mavlink
from groundstation.errors import DriverError
from sim_bridge.devices.camera_stream import PATH, CameraStream
from sim_bridge.devices.mavlink_open import announced
from sim_bridge.site import Lens

FIELD = Path(__file__).parents[3] / "config" / "mixed-team.yaml"


def run(*arguments):
    return CliRunner().invoke(mavlink, [str(a) for a in arguments], standalone_mode=False)


LENS = Lens(width_px=640, height_px=360, fx_px=554.0, fy_px=554.0, cx_px=319.5, cy_px=179.5, distortion=(0.0,) * 5)


def test_probe_names_who_answers(hangar):
    video = announced("v12", LENS, 15.0, "http://127.0.0.1:8080/video.mjpg")
    _, _, (address, port) = hangar.add("ardupilot", 12, aided=True, video=video)
    result = run("probe", f"udpout:{address}:{port}", "--seconds", 2)
    assert result.return_value == 0, result.output
    assert "system  12: ardupilot, 4.6.2, STABILIZE, disarmed, battery" in result.output
    assert "video http://127.0.0.1:8080/video.mjpg" in result.output


def test_a_stranger_that_reads_the_announcement_can_open_the_stream(hangar, monkeypatch):
    """Any MAVLink program, here pymavlink; the announced stream is the one that arrives."""
    monkeypatch.setenv("MAVLINK20", "1")
    stream = CameraStream("127.0.0.1", 0)
    source = None
    video = announced("v11", LENS, 15.0, f"http://127.0.0.1:{stream.port}{PATH}")
    _, _, (address, port) = hangar.add("px4", 11, video=video)
    ground = mavutil.mavlink_connection(f"udpout:{address}:{port}", dialect="ardupilotmega")
    try:
        ground.mav.command_long_send(11, 1, 512, 0, 269, 1, 0, 0, 0, 0, 0)
        said = ground.recv_match(type="VIDEO_STREAM_INFORMATION", blocking=True, timeout=5)
        assert (said.type, said.encoding, said.flags & 1) == (2, 0, 1), "MPEG over TCP, running: not RTSP"
        assert (said.framerate, said.resolution_h, said.resolution_v, said.hfov) == (15.0, 640, 360, 60)
        source = open_source(said.uri)
        jpeg = cv2.imencode(".jpg", np.full((said.resolution_v, said.resolution_h), 90, np.uint8))[1].tobytes()
        packet, deadline = None, time.monotonic() + 10
        while packet is None and time.monotonic() < deadline:
            stream.send_at(time.monotonic_ns(), jpeg)
            packet = source.take_newest(0.1)
        assert packet is not None and packet.data == jpeg
        ground.mav.command_long_send(11, 1, 512, 0, 269, 2, 0, 0, 0, 0, 0)
        answer = ground.recv_match(type="COMMAND_ACK", condition="COMMAND_ACK.result != 0", blocking=True, timeout=5)
        assert answer.result == 2, "there is no second stream"
    finally:
        ground.close()
        stream.close()
        if source is not None:
            source.close()


def test_probe_of_nobody_fails(port):
    result = run("probe", f"udpin:127.0.0.1:{port}", "--seconds", 0.5)
    assert result.return_value == 4 and "nobody answers" in result.output


@pytest.mark.parametrize(("flavour", "drone", "system"), [("px4", "drone_2", 11), ("ardupilot", "drone_3", 12)])
def test_setup_tells_and_sets_what_differs(hangar, flavour, drone, system):
    emulator, _, (address, port) = hangar.add(flavour, system, configured=False)
    place = ("--address", f"{address}:{port}")
    result = run("setup", "--check", FIELD, drone, *place)
    assert result.return_value == 1, result.output
    name = "EKF2_GPS_CTRL is 7, needs 0" if flavour == "px4" else "GUID_TIMEOUT is 3, needs 0.1 to 0.5"
    assert name in result.output
    assert not emulator.firmware.parameters.indoor
    result = run("setup", "--apply", FIELD, drone, *place)
    assert result.return_value == 0, result.output
    assert emulator.firmware.parameters.indoor
    assert "as needed; restart it before the first flight" in result.output
    assert "all parameters as needed" in run("setup", "--check", FIELD, drone, *place).output
    assert "restart" not in run("setup", "--apply", FIELD, drone, *place).output, "it changed nothing"


def test_setup_of_a_vehicle_with_a_receiver_lands_it_when_the_transmitter_is_lost(hangar):
    emulator, _, (address, port) = hangar.add("ardupilot", 12)
    place = ("--address", f"{address}:{port}")
    emulator.firmware.parameters.values["RC_OPTIONS"] = 33
    assert run("setup", "--check", FIELD, "drone_3", *place).output == (
        "RC_OPTIONS is 33, needs 2 in its sum (the sticks of another ground station would fly it, "
        "and count as a pilot's)\n"
    )
    emulator.firmware.transmitter = True
    result = run("setup", "--apply", FIELD, "drone_3", *place)
    assert result.return_value == 0 and "FS_THR_ENABLE is 0, needs 3 (" in result.output
    assert [emulator.firmware.parameters[name] for name in ("FS_THR_ENABLE", "RC_OPTIONS")] == [3, 35]


def test_setup_names_the_system_that_answers_in_place_of_the_wanted_one(hangar):
    _, _, (address, port) = hangar.add("px4", 1)
    result = run("setup", "--check", FIELD, "drone_2", "--address", f"{address}:{port}")
    assert isinstance(result.exception, DriverError)
    assert "system 11 does not answer, system 1 does" in str(result.exception)


def test_setup_tells_that_a_vehicle_calls_this_computer(hangar, port):
    hangar.add("px4", 11, calls=("127.0.0.1", port))
    result = run("setup", "--check", FIELD, "drone_2", "--address", f"127.0.0.1:{port}")
    why = f"system 11 does not answer at udpout:127.0.0.1:{port}, but calls this computer: set mavlink.listen to true"
    assert isinstance(result.exception, DriverError) and why in str(result.exception)


def test_setup_tells_how_to_look_for_a_vehicle_that_is_nowhere(port):
    error = str(run("setup", "--check", FIELD, "drone_2", "--address", f"127.0.0.1:{port}").exception)
    assert f"`groundstation mavlink probe udpout:127.0.0.1:{port}`" in error and "mavlink.listen: true" in error


def test_setup_refuses_another_autopilot_and_an_armed_one(hangar):
    emulator, _, (address, port) = hangar.add("px4", 12)
    result = run("setup", "--check", FIELD, "drone_3", "--address", f"{address}:{port}")
    assert isinstance(result.exception, DriverError) and "it is a PX4, the field says ardupilot" in str(
        result.exception
    )
    emulator, _, (address, port) = hangar.add("ardupilot", 12)
    emulator.firmware.armed = True
    result = run("setup", "--apply", FIELD, "drone_3", "--address", f"{address}:{port}")
    assert isinstance(result.exception, DriverError) and "armed" in str(result.exception)


@pytest.mark.parametrize(
    ("link", "told"),
    [
        ("udpin:127.0.0.1:80800", "must end in a port from 1 to 65535"),
        ("udpout:127.0.0.1:0", "must end in a port from 1 to 65535"),
        ("tcp:127.0.0.1:5760", "must be like udpin:0.0.0.0:14550"),
        ("serial:/dev/null:57600", "it is no serial port"),
    ],
)
def test_a_link_that_cannot_be_is_refused_by_name(link, told):
    assert told in str(run("probe", link).exception)


def test_probe_says_that_somebody_speaks_mavlink_1_only():
    old = mavutil.mavlink.MAVLink(None, srcSystem=7, srcComponent=1)
    heartbeat = old.heartbeat_encode(2, 3, 0, 0, 4).pack(old, force_mavlink1=True)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
        vehicle.bind(("127.0.0.1", 0))
        port = vehicle.getsockname()[1]
        answering = threading.Thread(target=lambda: [vehicle.sendto(heartbeat, vehicle.recvfrom(300)[1])])
        answering.start()
        result = run("probe", f"udpout:127.0.0.1:{port}", "--seconds", 1)
        answering.join(5.0)
    assert result.return_value == 4
    assert "speaks MAVLink 1 only" in result.output and "MAV_PROTO_VER 2" in result.output


def test_signed_link_hears_only_who_has_the_key(hangar, tmp_path):
    key = tmp_path / "key"
    key.write_text(bytes(range(32)).hex())
    key.chmod(0o600)
    signing = signing_of(LinkSettings(target="udpout:127.0.0.1:1", key_file=str(key)))
    emulator, _, (address, port) = hangar.add("ardupilot", 9, signing=signing)
    target = f"udpout:{address}:{port}"
    link = open_link(LinkSettings(target=target, key_file=str(key)))
    plain = open_link(LinkSettings(target=target))
    other = tmp_path / "other"
    other.write_bytes(os.urandom(32))
    other.chmod(0o600)
    wrong = open_link(LinkSettings(target=target, key_file=str(other)))
    try:
        deadline, heard = time.monotonic() + 4, list[Heard]()
        while not heard and time.monotonic() < deadline:
            for each in (plain, wrong, link):
                each.send(9, telemetry.Heartbeat(6, 8, 0, 0, 4))
            heard = link.receive()
        assert heard and heard[0].frame.system == 9
        assert emulator.rejected["unsigned"] and emulator.rejected["signature"]
        assert plain.receive() == [] and wrong.receive() == []
    finally:
        for each in (link, plain, wrong):
            each.close()


@pytest.mark.parametrize("content", [b"", b"short", b"zz" * 32])
def test_a_bad_key_is_named_but_not_shown(tmp_path, content):
    key = tmp_path / "key"
    key.write_bytes(content)
    key.chmod(0o600)
    with pytest.raises(DriverError, match="32 bytes") as refused:
        signing_of(LinkSettings(target="udpout:127.0.0.1:1", key_file=str(key)))
    assert content.decode() not in str(refused.value) or not content


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o644])
def test_a_key_that_others_can_read_is_none(tmp_path, mode):
    key = tmp_path / "key"
    key.write_bytes(bytes(range(32)))
    key.chmod(mode)
    with pytest.raises(DriverError, match="others can read it"):
        signing_of(LinkSettings(target="udpout:127.0.0.1:1", key_file=str(key)))


def test_a_companion_that_calls_from_elsewhere_does_not_take_the_address_of_its_autopilot():
    """A companion has the vehicle's system id; commands and failsafe frames are not for it."""
    link = UdpLink(LinkSettings(target="udpin:127.0.0.1:0"))
    companion = FrameEncoder(11, 191).encode(telemetry.Heartbeat(18, 8, 0, 0, 4))
    autopilot = FrameEncoder(11, 1).encode(telemetry.Heartbeat(2, 12, 1, 0, 3))
    now = time.monotonic_ns()
    link._judge(now, companion, ("127.0.0.3", 1))
    assert not link.called_from
    assert len(link._judge(now + 1, autopilot, ("127.0.0.2", 1))) == 1
    assert link._judge(now + 2, companion, ("127.0.0.3", 1)) == []
    assert list(link.called_from) == [("127.0.0.2", 1)]
    assert len(link._judge(now + 3, companion, ("127.0.0.2", 1))) == 1, "that of a vehicle's own router is heard"
    link._judge(now + 4_000_000_000, companion, ("127.0.0.3", 1))
    assert list(link.called_from) == [("127.0.0.2", 1)], "not even while the autopilot is silent"
    assert link.rejected == {"other_component": 2}
    link.close()


def test_duplicates_strangers_and_rubbish_are_refused_by_name():
    link = UdpLink(LinkSettings(target="udpin:127.0.0.1:0"))
    beat = FrameEncoder(11, 1).encode(telemetry.Heartbeat(2, 12, 1, 0, 3))
    now = time.monotonic_ns()
    assert len(link._judge(now, beat, ("127.0.0.2", 1))) == 1
    assert link._judge(now + 1, beat, ("127.0.0.3", 1)) == []
    # Its address may change once the old one is silent (a new DHCP lease, another radio).
    assert len(link._judge(now + 4_000_000_000, beat, ("127.0.0.3", 1))) == 1
    assert link._judge(now, b"rubbish", ("127.0.0.3", 1)) == []
    assert len(link._judge(now, beat + beat[:-3], ("127.0.0.3", 1))) == 1
    assert len(link._judge(now, beat, ("127.0.0.3", 1))) == 1, "the end of the frame before never came"
    own = FrameEncoder(255, 190).encode(telemetry.Heartbeat(6, 8, 0, 0, 4))
    assert link._judge(now, own, ("127.0.0.9", 1)) == []
    assert link.rejected == {"duplicate_system": 1, "no_frame": 1, "truncated": 1}
    link.close()
    out = UdpLink(LinkSettings(target="udpout:127.0.0.2:5"))
    assert out._judge(now, beat, ("127.0.0.7", 5)) == [] and out.rejected == {"foreign_address": 1}
    out.close()


def test_a_signed_link_refuses_what_is_unsigned_forged_or_played_again(tmp_path):
    key = tmp_path / "key"
    key.write_bytes(bytes(range(32)))
    key.chmod(0o600)
    ours = signing_of(LinkSettings(target="udpin:127.0.0.1:0", key_file=str(key)))
    assert ours is not None
    link = UdpLink(LinkSettings(target="udpin:127.0.0.1:0"), ours)
    beat, place, now = telemetry.Heartbeat(2, 3, 1, 4, 3), ("127.0.0.2", 1), time.monotonic_ns()
    good, stale = (
        FrameEncoder(11, n, Signing(ours.key, at)).encode(beat) for n, at in ((1, ours.timestamp), (2, 10**9))
    )
    assert link._judge(now, FrameEncoder(11, 1).encode(beat), place) == []
    assert link._judge(now, FrameEncoder(11, 1, Signing(bytes(32), ours.timestamp)).encode(beat), place) == []
    assert [heard.frame.system for heard, _ in link._judge(now, good, place)] == [11]
    assert link._judge(now, good, place) == []
    assert link._judge(now, stale, place) == []  # recorded years ago
    assert link.rejected == {"unsigned": 1, "signature": 1, "replayed": 2}
    link.close()
