"""Properties of every link: discovery, telemetry, commands, numbers exact to the bit, several vehicles, close."""

import itertools
import socket
import time
from typing import Any

import pytest

from drivers.mavlink.links.opening import open_link
from drivers.mavlink.links.seam import ignore_bytes
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.wire import flight, service, telemetry
from drivers.mavlink.wire.frames import FrameDecoder, FrameEncoder
from drivers.mavlink.wire.names import MavCmd
from groundstation.errors import DriverError


@pytest.fixture(params=["pymavlink", "mavsdk"])
def kind(request):
    return request.param


@pytest.fixture
def opened(kind):
    links = []

    def make(target, sniffer=ignore_bytes):
        links.append(open_link(LinkSettings(kind=kind, target=target), sniffer))
        return links[-1]

    yield make
    for link in links:
        link.close()


def collect(link, wanted, seconds=5.0, each=lambda: None):
    """Return all messages received until `wanted(heard)`; fails on time-out."""
    heard, deadline = [], time.monotonic() + seconds
    while time.monotonic() < deadline:
        each()
        heard += link.receive()
        if wanted(heard):
            return heard
    raise AssertionError(f"not heard within {seconds} s; got {sorted({type(h.frame.message).__name__ for h in heard})}")


def of(heard, kind, system=None):
    return [
        h.frame.message
        for h in heard
        if isinstance(h.frame.message, kind) and (system is None or h.frame.system == system)
    ]


def heartbeat(link, *systems):
    def send():
        for system in systems:
            link.send(system, telemetry.Heartbeat(6, 8, 0, 0, 4))

    return send


def noting(take, messages):
    """Return `take` of an emulator's services, which also records the messages."""

    def noted(frame, now, channel):
        messages.append(frame.message)
        return take(frame, now, channel)

    return noted


def test_it_speaks_first_and_is_answered_within_two_seconds(hangar, opened):
    _, _, (address, port) = hangar.add("px4", 7)
    link = opened(f"udpout:{address}:{port}")
    began = time.monotonic()
    heard = collect(link, lambda h: of(h, telemetry.Heartbeat, 7), 3.0, heartbeat(link, 7))
    assert time.monotonic() - began < 2.0
    assert of(heard, telemetry.Heartbeat)[0].autopilot == 12


def test_commands_are_acknowledged_and_rates_are_granted(hangar, opened):
    _, _, (address, port) = hangar.add("ardupilot", 9, aided=True)
    link = opened(f"udpout:{address}:{port}")
    each = heartbeat(link, 9)
    collect(link, lambda h: of(h, telemetry.Heartbeat, 9), 3.0, each)
    link.send(9, flight.CommandLong(9, 1, MavCmd.SET_MESSAGE_INTERVAL, 0, 32.0, 20_000.0))
    collect(link, lambda h: (511, 0) in [ack[:2] for ack in of(h, flight.CommandAckMessage)])
    heard = collect(link, lambda h: len(of(h, telemetry.LocalPositionNed)) > 20)
    stamps = [m.time_boot_ms for m in of(heard, telemetry.LocalPositionNed)]
    assert all(b - a == 20 for a, b in itertools.pairwise(stamps))
    link.send(9, flight.CommandLong(9, 1, 9999, 0))
    collect(link, lambda h: (9999, 3) in [ack[:2] for ack in of(h, flight.CommandAckMessage)])


def test_values_arrive_to_the_bit(hangar, opened):
    emulator, _, (address, port) = hangar.add("px4", 7)
    link = opened(f"udpout:{address}:{port}")
    collect(link, lambda h: of(h, telemetry.Heartbeat, 7), 3.0, heartbeat(link, 7))
    messages: list[Any] = []
    emulator.services.take = noting(emulator.services.take, messages)
    sent = flight.OdometryMessage(
        2**53 + 12345, 1, 12, 1.5, -2.25, -0.125, (0.5, 0.5, -0.5, 0.5), 0.25, 0.0, -0.75, 0.0, 0.0, 0.5,
        tuple(i / 8 for i in range(21)), tuple(-i / 4 for i in range(21)), 3, 2, 100,
    )  # fmt: skip
    setpoint = flight.SetPositionTargetLocalNed(5, 7, 1, 8, 0x5C7, *(0.0,) * 3, 0.5, -0.25, 0.125, *(0.0,) * 4, -0.5)
    link.send(7, sent)
    link.send(7, setpoint)
    link.send(7, service.ParamRequestRead(7, 1, "COM_OF_LOSS_T", -1))
    heard = collect(link, lambda h: of(h, service.ParamValue))
    assert sent in messages and setpoint in messages
    assert of(heard, service.ParamValue)[0][:2] == ("COM_OF_LOSS_T", 1.0)


def test_every_heartbeat_is_sent_since_an_ardupilot_lands_two_seconds_after_the_last(hangar, opened):
    emulator, _, (address, port) = hangar.add("ardupilot", 9)
    link = opened(f"udpout:{address}:{port}")
    beat = heartbeat(link, 9)
    collect(link, lambda h: of(h, telemetry.Heartbeat, 9), 3.0, beat)
    messages: list[Any] = []
    emulator.services.take = noting(emulator.services.take, messages)
    for _ in range(8):
        beat()
    collect(link, lambda _: sum(isinstance(m, telemetry.Heartbeat) for m in messages) >= 8, 2.0)


def test_two_vehicles_call_one_port_and_each_gets_its_own(hangar, opened, port):
    place = ("127.0.0.1", port)
    link = opened(f"udpin:127.0.0.1:{port}")
    hangar.add("px4", 21, calls=place)
    hangar.add("ardupilot", 22, calls=place)
    each = heartbeat(link, 21, 22)
    collect(link, lambda h: of(h, telemetry.Heartbeat, 21) and of(h, telemetry.Heartbeat, 22), 4.0, each)
    for system in (21, 22):
        link.send(system, service.ParamRequestRead(system, 1, "SYSID_MYGCS" if system == 22 else "EKF2_EV_CTRL", -1))
    heard = collect(link, lambda h: of(h, service.ParamValue, 21) and of(h, service.ParamValue, 22), 4.0)
    assert of(heard, service.ParamValue, 21)[0].param_id == "EKF2_EV_CTRL"
    assert of(heard, service.ParamValue, 22)[0].param_value == 255.0


def test_silence_returns_and_close_gives_the_port_back(kind, opened, port):
    link = open_link(LinkSettings(kind=kind, target=f"udpin:127.0.0.1:{port}"))
    began = time.monotonic()
    assert link.receive() == []
    assert time.monotonic() - began < 1.0
    link.send(5, flight.CommandLong(5, 1, 21, 0))  # to nobody
    link.close()
    again = opened(f"udpin:127.0.0.1:{port}")
    assert again.receive() == []


def test_a_taken_port_is_named(kind, opened, port):
    opened(f"udpin:127.0.0.1:{port}")
    with pytest.raises(DriverError, match=str(port)):
        open_link(LinkSettings(kind=kind, target=f"udpin:127.0.0.1:{port}"))


def test_a_pose_reaches_the_vehicle_it_is_of_and_no_other(hangar, opened, port):
    """ODOMETRY, VISION_POSITION_ESTIMATE and TIMESYNC name no target: on a shared port only the address decides."""
    place = ("127.0.0.1", port)
    link = opened(f"udpin:127.0.0.1:{port}")
    taken: dict[int, list[Any]] = {}
    for system in (21, 22):
        emulator, _, _ = hangar.add("px4", system, calls=place)
        taken[system] = []
        emulator.services.take = noting(emulator.services.take, taken[system])
    each = heartbeat(link, 21, 22)
    collect(link, lambda h: of(h, telemetry.Heartbeat, 21) and of(h, telemetry.Heartbeat, 22), 4.0, each)
    for system in (21, 22):
        link.send(system, service.Timesync(1_000 + system, 5))
        link.send(system, flight.VisionPositionEstimate(77, system / 4, *(0.0,) * 5, (0.0,) * 21, 0))
        link.send(system, service.ParamRequestRead(system, 1, "EKF2_EV_CTRL", -1))
    collect(link, lambda h: of(h, service.ParamValue, 21) and of(h, service.ParamValue, 22), 4.0)
    for system, messages in taken.items():
        assert [m.tc1 for m in messages if isinstance(m, service.Timesync)] == [1_000 + system]
        assert [m.x for m in messages if isinstance(m, flight.VisionPositionEstimate)] == [system / 4]


def test_the_recording_contains_the_original_frames_of_every_link(hangar, opened):
    """On every link, the recording and its .tlog contain the original frames."""
    _, _, (address, port) = hangar.add("px4", 7)
    told = []
    link = opened(f"udpout:{address}:{port}", lambda system, at, data, received: told.append((system, data, received)))
    collect(link, lambda h: of(h, telemetry.Heartbeat, 7), 3.0, heartbeat(link, 7))
    setpoint = flight.SetPositionTargetLocalNed(5, 7, 1, 8, 0x5C7, *(0.0,) * 3, 0.5, -0.25, 0.125, *(0.0,) * 4, -0.5)
    link.send(7, setpoint)
    link.send(7, service.ParamRequestRead(7, 1, "COM_OF_LOSS_T", -1))
    heard = collect(link, lambda h: of(h, service.ParamValue))
    decoder = FrameDecoder()
    frames = {
        way: [decoder.decode(data) for system, data, r in told if r is way and system == 7] for way in (True, False)
    }
    assert setpoint in [frame.message for frame in frames[False]]
    assert all((frame.system, frame.component) == (255, 190) for frame in frames[False])
    assert of(heard, service.ParamValue)[0] in [frame.message for frame in frames[True]]
    numbers = {(f.component, f.sequence) for f in frames[True]}
    assert {(h.frame.component, h.frame.sequence) for h in heard} <= numbers


@pytest.mark.slow
def test_a_vehicle_that_goes_and_comes_again_and_again_is_spoken_to_again(hangar, opened):
    emulator, _, (address, port) = hangar.add("px4", 7)
    link = opened(f"udpout:{address}:{port}")
    each = heartbeat(link, 7)
    for silence_s in (0.3, 1.0, 3.5):  # the last beyond the time after which MAVSDK gives up a vehicle
        collect(link, lambda h: of(h, telemetry.Heartbeat, 7), 3.0, each)
        emulator.silent = True
        time.sleep(silence_s)
        while link.receive():
            pass
        emulator.silent = False
        collect(link, lambda h: of(h, telemetry.Heartbeat, 7), 3.0, each)
        link.send(7, service.ParamRequestRead(7, 1, "COM_OF_LOSS_T", -1))
        assert of(collect(link, lambda h: of(h, service.ParamValue), 2.0), service.ParamValue)


def test_strangers_duplicates_and_broken_frames_are_refused_by_name(opened, port):
    link = opened(f"udpin:127.0.0.1:{port}")
    beat = FrameEncoder(21, 1).encode(telemetry.Heartbeat(2, 12, 1, 0, 3))
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as first,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
    ):
        for udp in (first, other):
            udp.bind(("127.0.0.1", 0))
        first.sendto(beat, ("127.0.0.1", port))
        collect(link, lambda h: of(h, telemetry.Heartbeat, 21))
        other.sendto(beat, ("127.0.0.1", port))  # the same system id from elsewhere
        first.sendto(b"rubbish", ("127.0.0.1", port))
        first.sendto(beat[:-1] + bytes([beat[-1] ^ 1]), ("127.0.0.1", port))
        collect(link, lambda h: link.rejected["checksum"], 2.0)
    assert link.rejected == {"duplicate_system": 1, "no_frame": 1, "checksum": 1}
