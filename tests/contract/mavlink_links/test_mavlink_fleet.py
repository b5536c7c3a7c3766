"""The MAVLink driver on real sockets: a fleet on one port, strangers, duplicates, a vehicle that leaves."""

import itertools
import os
import pty
import socket
import sys
import threading
import time
from pathlib import Path

import pytest

from drivers.mavlink.driver import RATE_HZ, Fleet, hosts_of
from drivers.mavlink.links.seam import Heard
from drivers.mavlink.settings import MavlinkDriverSettings
from drivers.mavlink.wire.frames import FrameEncoder, ReceivedFrame
from drivers.mavlink.wire.names import AUTOPILOT_COMPONENT
from drivers.mavlink.wire.telemetry import BatteryStatus, Heartbeat
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import Command, Lease, Verb
from groundstation.bus.topics import COMMAND, IMU, LEASE, ODOMETRY, VEHICLE_STATUS

sys.path.insert(0, str(Path(__file__).parents[1]))  # for the helper modules of that folder
from mavlink_process import FakeProcess

_ids = itertools.count()


class Flying:
    """A fleet with hosts, run by this thread."""

    def __init__(self, target, vehicles, kind="pymavlink"):
        exchange = MemoryExchange()
        self.other = MemoryBus(exchange, "lab", "other")
        self.process = FakeProcess(MemoryBus(exchange, "lab", "mavlink"))
        self.settings = MavlinkDriverSettings.model_validate(
            {
                "link": {"target": target, "kind": kind},
                "vehicles": [{"name": f"v{s}", "system_id": s, "flavour": f} for s, f in vehicles.items()],
            }
        )
        self.heard = {t: self.other.subscribe([t], capacity=100_000) for t in (ODOMETRY, IMU, VEHICLE_STATUS)}
        self.fleet = Fleet(self.process, self.settings)
        self.hosts = hosts_of(self.process, self.fleet, self.settings)

    def turn(self, seconds, until=lambda: False):
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline and not until():
            now = time.monotonic_ns()
            self.fleet.turn(now)
            for host in self.hosts:
                host.turn(now)
            time.sleep(1 / RATE_HZ)
        return until()

    def messages(self, topic):
        return [r.message for r in self.heard[topic].drain()]

    def order(self, verb):
        now, header = time.monotonic_ns(), self.other.header("team")
        self.other.publish(LEASE, Lease(header=header, holder="op", expires_ns=now + 10**10))
        command = Command(header=header, id=f"c{next(_ids)}", verb=verb, scope=(), issuer="op", expires_ns=now + 10**10)
        self.other.publish(COMMAND, command)

    def close(self):
        self.fleet.close()


@pytest.fixture(params=["pymavlink", "mavsdk"])
def kind(request):
    return request.param


def ready(flying):
    return all(h.watchdog.mode == "LANDED" and not h.watchdog.vehicle.not_ready for h in flying.hosts)


def test_both_flavours_on_one_port_come_to_be_ready(hangar, port, kind):
    place = ("127.0.0.1", port)
    flying = Flying(f"udpin:127.0.0.1:{port}", {21: "px4", 22: "ardupilot"}, kind)
    hangar.add("px4", 21, calls=place)
    hangar.add("ardupilot", 22, calls=place)
    hangar.add("px4", 23, calls=place)
    try:
        assert flying.turn(10.0, lambda: ready(flying)), [h.watchdog.vehicle.not_ready for h in flying.hosts]
        flying.messages(ODOMETRY), flying.messages(IMU)
        flying.turn(1.0)
        odometry, imu = flying.messages(ODOMETRY), flying.messages(IMU)
        assert {m.header.entity for m in odometry} == {"v21", "v22"}
        at = f"udpin:127.0.0.1:{port}"
        assert flying.process.states == [f"READY v21 at {at}; v22 at {at}"], "told once, though both are at each turn"
        assert len(odometry) > 60 and len(imu) > 30
        assert flying.fleet.link.rejected["unknown_system"] > 0
        assert [t for t in flying.process.texts if "system 23" in t] == [
            "system 23 answers, which is not in the field file"
        ]
    finally:
        flying.close()


def test_another_ground_station_that_a_vehicle_passes_on_is_told_once(hangar, port, kind):
    hangar.add("ardupilot", 21, calls=("127.0.0.1", port))
    flying = Flying(f"udpin:127.0.0.1:{port}", {21: "ardupilot"}, kind)
    others = [FrameEncoder(254, 190), FrameEncoder(255, 190)]  # the second has our own ids
    told = lambda: [text for text in flying.process.texts if "another ground station" in text]  # noqa: E731
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as router:
        try:
            for _ in range(4):
                for other in others:
                    router.sendto(other.encode(Heartbeat(6, 8, 192, 0, 4)), ("127.0.0.1", port))
                flying.turn(0.6)
            assert flying.turn(8.0, lambda: len(told()) == 2), flying.process.texts
            first, second = sorted(told())
            assert first == "another ground station is on this link (system 254)"
            assert second.startswith("v21 refused ") and "heartbeats of another ground station with our" in second
        finally:
            flying.close()


def test_wrong_flavour_is_refused_and_named(hangar, kind):
    _, _, (address, port) = hangar.add("px4", 9)
    flying = Flying(f"udpout:{address}:{port}", {9: "ardupilot"}, kind)
    try:
        assert flying.turn(3.0, lambda: flying.fleet.vehicles[9].health(0).rejected.get("wrong_flavour", 0) > 0)
        assert flying.turn(8.0, lambda: any("trying on" in text for text in flying.process.texts))
        assert flying.hosts[0].watchdog.mode == "CONNECTING"
        why = "it is a PX4, the field says ardupilot: set mavlink.flavour"
        assert f"v9: {why}; trying on" in flying.process.texts
        assert any("heartbeats of another firmware than the field says" in text for text in flying.process.texts)
        assert flying.messages(VEHICLE_STATUS)[-1].detail == why
    finally:
        flying.close()


def test_a_vehicle_with_another_number_than_the_fields_is_named(hangar, kind):
    _, _, (address, port) = hangar.add("px4", 1)
    flying = Flying(f"udpout:{address}:{port}", {9: "px4"}, kind)
    why = "system 1 answers here, the field says 9: set mavlink.system_id"
    try:
        assert flying.turn(8.0, lambda: any("trying on" in text for text in flying.process.texts))
        assert f"v9: {why}; trying on" in flying.process.texts
        assert flying.messages(VEHICLE_STATUS)[-1].detail == why
    finally:
        flying.close()


def test_two_senders_of_one_number_ground_that_vehicle_and_no_other(hangar, port):
    place = ("127.0.0.1", port)
    flying = Flying(f"udpin:127.0.0.1:{port}", {21: "px4", 22: "px4"})
    for system in (21, 22):
        hangar.add("px4", system, calls=place)
    second, fault = hangar.add("px4", 21, calls=place)[0], "a second address sends with its system id 21"
    reasons = lambda: [host.watchdog.vehicle.not_ready.split(":")[0] for host in flying.hosts]  # noqa: E731
    try:
        assert flying.turn(12.0, lambda: reasons() == [fault, ""]), reasons()
        told = lambda: [text for text in flying.process.texts if "from a second address" in text]  # noqa: E731
        flying.turn(1.0)
        assert len(told()) == 1 and told()[0].startswith("v21 refused ")
        second.silent = True  # it is switched off
        assert flying.turn(8.0, lambda: reasons() == ["", ""]), reasons()
    finally:
        flying.close()


def test_a_vehicle_that_speaks_mavlink_1_only_is_told_once_it_does_not_answer():
    radio, line = pty.openpty()
    flying = Flying(f"serial:{os.ttyname(line)}:921600", {9: "px4"})
    beat = FrameEncoder(9, 1).encode(Heartbeat(2, 12, 81, 0, 3), old=True)
    try:
        for _ in range(12):
            os.write(radio, beat)
            flying.turn(0.5)
        assert flying.process.texts == ["v9: it speaks MAVLink 1 only: set version 2 on it; trying on"]
        os.write(radio, FrameEncoder(9, 1).encode(Heartbeat(2, 12, 81, 0, 3)) + beat)
        flying.turn(0.5)
        assert flying.fleet.vehicles[9].health(time.monotonic_ns()).detail.startswith("asking for")
    finally:
        flying.close()
        os.close(radio)
        os.close(line)


def test_a_line_with_little_room_and_what_it_loses_are_told():
    radio, line = pty.openpty()
    flying = Flying(f"serial:{os.ttyname(line)}:115200", {9: "px4"})
    try:
        flying.fleet.turn(0)
        assert len(flying.process.texts) == 1 and "115200 leaves little room: 9.0 kB/s" in flying.process.texts[0]
        flying.fleet.link.rejected["send_dropped"] += 20
        flying.fleet.turn(1)
        assert flying.process.texts[1:] == [
            "the serial line carries less than is sent: poses and setpoints are left out"
        ]
    finally:
        flying.close()
        os.close(radio)
        os.close(line)


def test_a_vehicle_that_vanishes_is_lost_and_found_again(hangar, kind):
    emulator, _, (address, port) = hangar.add("px4", 9)
    flying = Flying(f"udpout:{address}:{port}", {9: "px4"}, kind)
    host = flying.hosts[0]
    try:
        assert flying.turn(8.0, lambda: host.watchdog.mode == "LANDED")
        emulator.silent = True
        assert flying.turn(2.0, lambda: not host.watchdog.vehicle.fresh)
        flying.turn(1.2)
        assert any("does not answer" in text for text in flying.process.texts)
        emulator.silent = False
        assert flying.turn(3.0, lambda: host.watchdog.vehicle.fresh)
    finally:
        flying.close()


def test_close_ends_the_reader(hangar):
    _, _, (address, port) = hangar.add("px4", 9)
    before = threading.active_count()
    flying = Flying(f"udpout:{address}:{port}", {9: "px4"})
    flying.turn(0.2)
    flying.close()
    assert threading.active_count() == before


REASONS = (
    "Arm: Throttle too high",
    "Arm: Battery 1 below minimum arming voltage and also this text is longer than a frame",
)


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_a_refused_arming_lists_all_reasons(hangar, kind, flavour):
    """They arrive after the acknowledgement, one of them in two parts, and on every link."""
    emulator, _, (address, port) = hangar.add(flavour, 9)
    flying = Flying(f"udpout:{address}:{port}", {9: flavour}, kind)
    try:
        assert flying.turn(10.0, lambda: ready(flying)), flying.hosts[0].watchdog.vehicle.not_ready
        firmware = emulator.firmware

        def refuse(force=False):
            firmware.texts.extend((2, text) for text in REASONS)
            return firmware.arming_refusal, REASONS[0]

        firmware.arm = refuse
        flying.order(Verb.TAKEOFF)
        refused = lambda: [t for t in flying.process.texts if "arming: " in t]  # noqa: E731
        assert flying.turn(8.0, refused), flying.process.texts
        result = "temporarily rejected" if flavour == "px4" else "failed"
        assert refused()[0] == f"v9: arming: {result} ({'; '.join(REASONS)})"
        assert not firmware.armed and flying.hosts[0].watchdog.mode in ("TAKING_OFF", "LANDED")
    finally:
        flying.close()


@pytest.mark.slow
def test_a_command_that_is_never_answered_is_said_to_be(hangar, kind):
    emulator, _, (address, port) = hangar.add("ardupilot", 9)
    flying = Flying(f"udpout:{address}:{port}", {9: "ardupilot"}, kind)
    try:
        assert flying.turn(10.0, lambda: ready(flying)), flying.hosts[0].watchdog.vehicle.not_ready
        commands = emulator.services._commands
        take = commands.take
        commands.take = lambda frame, asked, rates: [] if asked.command == 176 else take(frame, asked, rates)
        flying.order(Verb.TAKEOFF)
        assert flying.turn(6.0, lambda: any("guided mode: no answer" in t for t in flying.process.texts))
        assert not emulator.firmware.armed
    finally:
        flying.close()


def test_parameters_and_health_forbid_a_take_off_on_every_link(hangar, kind):
    emulator, copter, (address, port) = hangar.add("ardupilot", 9)
    emulator.firmware.parameters.values["GUID_TIMEOUT"] = 3.0
    flying = Flying(f"udpout:{address}:{port}", {9: "ardupilot"}, kind)
    reason = lambda: flying.hosts[0].watchdog.vehicle.not_ready  # noqa: E731
    try:
        assert flying.turn(10.0, lambda: "GUID_TIMEOUT is 3, needs 0.1 to 0.5" in reason()), reason()
        emulator.firmware.parameters.values["GUID_TIMEOUT"] = 0.5
        emulator.silent = True  # it has restarted: everything is read again
        flying.turn(2.5)
        emulator.silent = False
        assert flying.turn(10.0, lambda: ready(flying)), reason()
        copter.battery = 0.05
        assert flying.turn(3.0, lambda: "does not want to arm" in reason()), reason()
    finally:
        flying.close()


def test_the_charge_is_that_of_the_first_battery_whatever_a_payloads_says(hangar):
    _, copter, (address, port) = hangar.add("px4", 9)
    flying = Flying(f"udpout:{address}:{port}", {9: "px4"})
    vehicle = flying.fleet.vehicles[9]
    try:
        copter.battery = 0.4
        charge = lambda: vehicle.view(time.monotonic_ns()).battery  # noqa: E731
        assert flying.turn(5.0, lambda: charge() == pytest.approx(0.4, abs=0.011)), charge()
        for percent in (90, 5):
            second = BatteryStatus(1, 0, 0, 0, (0,) * 10, 0, 0, 0, percent)
            vehicle.take(Heard(time.monotonic_ns(), ReceivedFrame(9, AUTOPILOT_COMPONENT, 0, second)))
            assert charge() == pytest.approx(0.4, abs=0.011)
    finally:
        flying.close()
