"""Stand-alone MAVLink vehicles: GPS position, take-off by command, mission requests."""

import socket
import subprocess
import sys
from collections.abc import Iterator
from itertools import count

import pytest

from drivers.mavlink.wire import service as s
from drivers.mavlink.wire.flight import CommandLong
from drivers.mavlink.wire.frames import Message, ReceivedFrame
from drivers.mavlink.wire.names import MavCmd
from drivers.mavlink.wire.positioning import GlobalPositionInt, GpsRawInt
from sim_bridge.devices.ardrone_firmware import DEFAULT, FIRMWARES
from sim_bridge.devices.mavlink import LinkHabits, MavlinkEmulator
from sim_bridge.scenario import parse_scenario
from sim_bridge.standalone import Hangar, MavlinkChoice
from sim_bridge.world.mavlink_copter import MavlinkCopter
from sim_bridge.world.world import TICK_NS

_net = count(1)


class Room:
    """One standalone vehicle, stepped by hand."""

    def __init__(self, kind: str, indoor: bool = False) -> None:
        name = f"{kind}@127.93.4.{next(_net)}"
        self.hangar = Hangar([name], FIRMWARES[DEFAULT], mavlink=MavlinkChoice(indoor=indoor))
        vehicle = self.hangar._stage.emulators[name]
        assert isinstance(vehicle, MavlinkEmulator)
        self.vehicle, self.body = vehicle, self.hangar.world.of(MavlinkCopter)[name].airframe
        self._ticks = 0

    def turn(self, seconds: float) -> None:
        for _ in range(round(seconds * 200)):
            self._ticks += 1
            self.hangar.tick(self._ticks * TICK_NS)

    def ask(self, message: Message) -> list[Message]:
        frame, channel = ReceivedFrame(255, 190, 0, message), self.vehicle.channel(("127.0.0.1", 14999))
        return self.vehicle.services.take(frame, self.vehicle.now_ns, channel)

    def order(self, command: MavCmd, *values: float) -> int:
        *_, ack = self.ask(CommandLong(1, 1, command, 0, *values))
        return int(ack[1])


@pytest.fixture(params=["px4", "ardupilot"])
def room(request: pytest.FixtureRequest) -> Iterator[Room]:
    room = Room(request.param)
    yield room
    room.hangar.close()


def test_it_takes_off_by_command_and_lands(room: Room) -> None:
    room.turn(2.0)
    px4 = room.vehicle.firmware.flavour.name == "PX4"
    if not px4:
        assert room.order(MavCmd.DO_SET_MODE, 1.0, 4.0) == 0
    assert room.order(MavCmd.COMPONENT_ARM_DISARM, 1.0) == 0
    height = (float("nan"),) * 7 if px4 else (0.0,) * 6 + (2.5,)
    assert room.order(MavCmd.NAV_TAKEOFF, *height) == 0
    room.turn(10.0)
    assert room.body.z == pytest.approx(2.5, abs=0.25)
    assert room.order(MavCmd.NAV_LAND) == 0
    room.turn(12.0)
    assert room.body.on_ground and not room.vehicle.firmware.armed


def test_satellites_tell_where_it_is(room: Room) -> None:
    room.turn(1.0)
    speaker = room.vehicle.speaker
    fix, place = speaker.gps(), speaker.global_position()
    assert isinstance(fix, GpsRawInt) and fix.fix_type == 3 and isinstance(place, GlobalPositionInt)
    assert fix.lat / 1e7 == pytest.approx(47.397742, abs=1e-6) and abs(place.relative_alt) < 100


def test_missions_are_none_and_uploads_are_refused_not_ignored(room: Room) -> None:
    assert room.ask(s.MissionRequestList(1, 1, 2)) == [s.MissionCount(255, 190, 0, 2)]
    assert room.ask(s.MissionCount(1, 1, 3, 0)) == [s.MissionAck(255, 190, 3, 0)]
    assert room.ask(s.MissionClearAll(1, 1, 1)) == [s.MissionAck(255, 190, 0, 1)]
    px4 = room.vehicle.firmware.flavour.name == "PX4"
    none = [s.MissionCount(255, 190, 0, 0), s.MissionAck(255, 190, 13, 0)]
    assert room.ask(s.MissionRequestInt(1, 1, 0, 0)) == ([] if px4 else none)


def test_without_satellites_it_says_so_and_stays_on_the_floor() -> None:
    room = Room("px4", indoor=True)
    try:
        room.turn(1.0)
        fix = room.vehicle.speaker.gps()
        assert isinstance(fix, GpsRawInt) and fix.fix_type == 0
        assert room.vehicle.speaker.global_position() is None
        assert room.order(MavCmd.COMPONENT_ARM_DISARM, 1.0) != 0
    finally:
        room.hangar.close()


def test_a_scenario_gives_it_errors_and_habits() -> None:
    scenario = parse_scenario(b'{"schema_version": 1, "mavlink": {"velocity_gain": [0.5, 0.5], "one_partner": true}}')
    name = f"ardupilot@127.93.4.{next(_net)}"
    hangar = Hangar([name], FIRMWARES[DEFAULT], mavlink=MavlinkChoice(indoor=True), scenario=scenario)
    try:
        vehicle = hangar._stage.emulators[name]
        assert isinstance(vehicle, MavlinkEmulator) and vehicle.habits == LinkHabits(one_partner=True)
        assert vehicle.firmware.parameters.indoor and vehicle.firmware.copter._gain == 0.5
    finally:
        hangar.close()


def test_a_program_finds_a_shipped_scenario_by_its_name() -> None:
    """This scenario has MAVLink 1 until the first contact."""
    address = f"127.93.4.{next(_net)}"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as waiting:
        waiting.bind(("127.0.0.1", 0))
        waiting.settimeout(60.0)
        call = "{}:{}".format(*waiting.getsockname())
        command = [sys.executable, "-m", "sim_bridge.standalone", f"px4@{address}", "--call", call]
        with subprocess.Popen([*command, "--scenario", "unkind-autopilots"]) as program:
            try:
                assert waiting.recv(512)[0] == 0xFE
            finally:
                program.terminate()


def test_a_wrong_scenario_is_named_without_a_traceback() -> None:
    command = [sys.executable, "-m", "sim_bridge.standalone", "px4@127.93.4.250", "--scenario", "unkind-autopilot"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=100, check=False)
    assert result.returncode == 2
    assert "did you mean unkind-autopilots?" in result.stderr and "Traceback" not in result.stderr
