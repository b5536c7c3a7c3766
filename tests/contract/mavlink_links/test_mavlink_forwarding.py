"""A second ground station on a forwarded link sees the vehicle and may stop it, but cannot fly it or crowd us out."""

import socket
import struct
import sys
import time
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.driver import Fleet
from drivers.mavlink.links.forwarding import with_riders
from drivers.mavlink.links.opening import open_link
from drivers.mavlink.settings import LinkSettings, MavlinkDriverSettings, VehicleSettings
from drivers.mavlink.signing_clock import SigningClock
from drivers.mavlink.wire.flight import CommandAckMessage, CommandLong, SetPositionTargetLocalNed
from drivers.mavlink.wire.frames import FrameDecoder, FrameEncoder, split
from drivers.mavlink.wire.names import MavCmd, MavResult
from drivers.mavlink.wire.service import FileTransferProtocol, ParamRequestList
from drivers.mavlink.wire.telemetry import Heartbeat
from drivers.mavlink.wire.verification import Signing
from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange

sys.path.insert(0, str(Path(__file__).parents[1]))  # for the helper modules of that folder
from mavlink_process import FakeProcess

HEARTBEAT = Heartbeat(2, 12, 81, 0, 4)


class Ground:
    """A vehicle, our link to it, and a second ground station, all stepped by hand."""

    def __init__(self, allows=(), key=b""):
        self.vehicle = udp()
        self.station = udp()
        self.told: list[str] = []
        ours = VehicleSettings(
            name="drone_2", system_id=11, flavour="px4", forward_allows=allows,
            forward=f"udp:127.0.0.1:{self.station.getsockname()[1]}",
        )  # fmt: skip
        address, port = self.vehicle.getsockname()
        self.link = open_link(
            LinkSettings(target=f"udpout:{address}:{port}"),
            shown=lambda transport: with_riders(transport, {11: ours}, lambda text, _: self.told.append(text), key),
        )
        self.vehicle_says, self.station_says = FrameEncoder(11, 1), FrameEncoder(255, 190)
        self.link.send(11, HEARTBEAT)
        _, self.ours = self.vehicle.recvfrom(2048)
        self.take()
        _, self._rider = self.station.recvfrom(2048)

    def take(self):
        """Let the vehicle send and our link receive."""
        self.vehicle.sendto(self.vehicle_says.encode(HEARTBEAT), self.ours)
        return eventually(self.link.receive)

    def order(self, *messages):
        for message in messages:
            self.station.sendto(self.station_says.encode(message), self._rider)

    def send_raw(self, data):
        self.station.sendto(data, self._rider)

    def close(self):
        self.link.close()
        self.vehicle.close()
        self.station.close()


def udp():
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.bind(("127.0.0.1", 0))
    made.settimeout(2.0)
    return made


def eventually(ask, within_s=3.0):
    deadline = time.monotonic() + within_s
    while time.monotonic() < deadline:
        found = ask()
        if found:
            return found
    pytest.fail("nothing came")


def message_of(made):
    (raw,) = split(made.recvfrom(2048)[0])
    return FrameDecoder().decode(raw).message


def assembled(number, extra, payload, system, component):
    """Return a frame of a kind that pymavlink does not know; extra: the seed of its checksum."""
    head = bytes((0xFD, len(payload), 0, 0, 0, system, component)) + number.to_bytes(3, "little")
    checksum = dialect.x25crc(head[1:] + payload + bytes([extra])).crc
    return head + payload + checksum.to_bytes(2, "little")


def nothing_comes(made):
    made.settimeout(0.3)
    with pytest.raises(TimeoutError):
        made.recvfrom(2048)
    made.settimeout(2.0)


@pytest.fixture
def ground():
    made = Ground()
    yield made
    made.close()


def command(number, *values):
    return CommandLong(11, 1, number, 0, *values)


def test_it_sees_what_the_vehicle_sends(ground):
    ground.take()
    assert message_of(ground.station) == HEARTBEAT


def test_it_sees_a_px4s_events_and_may_ask_for_one_that_it_missed(ground):
    event = assembled(410, 160, bytes(range(1, 24)), 11, 1)
    ground.vehicle.sendto(event, ground.ours)
    eventually(ground.link.receive)
    assert ground.station.recvfrom(2048)[0] == event
    request = assembled(412, 33, struct.pack("<HHBB", 7, 7, 11, 1), 255, 190)
    ground.send_raw(request)
    assert ground.vehicle.recvfrom(2048)[0] == request


def test_its_stop_reaches_the_vehicle_byte_for_byte_and_is_told(ground):
    ground.order(command(MavCmd.NAV_LAND))
    assert message_of(ground.vehicle) == command(MavCmd.NAV_LAND)
    eventually(lambda: ground.told)
    assert ground.told == ["drone_2: a second ground station stops it (LAND)"]


def test_of_stops_without_pause_all_pass_and_the_first_is_told(ground):
    for _ in range(50):
        ground.order(command(MavCmd.NAV_LAND), command(MavCmd.COMPONENT_ARM_DISARM))
        assert message_of(ground.vehicle) == command(MavCmd.NAV_LAND)
        assert message_of(ground.vehicle) == command(MavCmd.COMPONENT_ARM_DISARM)
    assert len(ground.told) == 2
    time.sleep(1.1)
    ground.order(command(MavCmd.NAV_LAND))
    assert eventually(lambda: ground.told[2:]) == ["drone_2: a second ground station stops it (LAND)"]


def test_a_flood_of_stops_passes_50_times_a_second_and_hides_no_other(ground):
    began = time.monotonic()
    for number in range(400):
        ground.order(command(MavCmd.NAV_LAND))
        if number == 200:
            ground.order(command(MavCmd.COMPONENT_ARM_DISARM))
        time.sleep(0.001)
    took_s = time.monotonic() - began
    came = []
    with pytest.raises(TimeoutError):
        while True:
            came.append(message_of(ground.vehicle))
    assert 5 <= len(came) <= 50 * took_s + 4
    assert command(MavCmd.COMPONENT_ARM_DISARM) in came and came[-1] == command(MavCmd.NAV_LAND)


def test_a_stop_that_the_vehicle_refuses_is_told(ground):
    ground.order(command(MavCmd.DO_SET_MODE, 1.0, 4.0, 3.0))
    assert message_of(ground.vehicle).command == MavCmd.DO_SET_MODE
    eventually(lambda: ground.told)
    ground.vehicle.sendto(
        ground.vehicle_says.encode(
            CommandAckMessage(MavCmd.DO_SET_MODE, MavResult.TEMPORARILY_REJECTED, 0, 0, 255, 190)
        ),
        ground.ours,
    )
    eventually(ground.link.receive)
    assert ground.told == [
        "drone_2: a second ground station stops it (HOLD)",
        "drone_2 refuses the stop of a second ground station (HOLD: temporarily rejected)",
    ]


def test_an_accepted_stop_and_a_refusal_of_something_else_are_not_told(ground):
    ground.order(command(MavCmd.NAV_LAND))
    message_of(ground.vehicle)
    eventually(lambda: ground.told)
    for number, result in ((MavCmd.NAV_LAND, MavResult.ACCEPTED), (MavCmd.SET_MESSAGE_INTERVAL, MavResult.DENIED)):
        answer = CommandAckMessage(number, result, 0, 0, 255, 190)
        ground.vehicle.sendto(ground.vehicle_says.encode(answer), ground.ours)
        eventually(ground.link.receive)
    assert len(ground.told) == 1


def test_it_cannot_arm_and_is_told_so_by_an_answer(ground):
    ground.order(command(MavCmd.COMPONENT_ARM_DISARM, 1.0))
    answer = message_of(ground.station)
    assert isinstance(answer, CommandAckMessage)
    assert (answer.command, answer.result) == (MavCmd.COMPONENT_ARM_DISARM, MavResult.DENIED)
    nothing_comes(ground.vehicle)
    assert ground.link.rejected["rider_refused"] == 1


def test_a_file_is_refused_aloud_so_that_it_asks_for_parameters_at_once(ground):
    opens = FileTransferProtocol(0, 11, 1, (7, 0, 3, 4, *(0,) * 247))
    ground.order(opens._replace(target_system=12), opens)
    answer = message_of(ground.station)
    assert isinstance(answer, FileTransferProtocol)
    assert (answer.target_system, *answer.payload[:6], answer.payload[12]) == (255, 8, 0, 3, 129, 1, 4, 1)
    nothing_comes(ground.vehicle)
    nothing_comes(ground.station)


def test_setpoints_heartbeats_parameters_and_garbage_do_not_pass_and_stops_behind_them_do(ground):
    setpoint = SetPositionTargetLocalNed(0, 11, 1, 8, 0x5C7, *(0.0,) * 11)
    ground.order(setpoint, HEARTBEAT, ParamRequestList(11, 1))
    ground.send_raw(b"\xfd\x09garbage")
    ground.send_raw(bytes(2000))
    nothing_comes(ground.vehicle)
    ground.order(command(MavCmd.NAV_LAND))
    assert message_of(ground.vehicle) == command(MavCmd.NAV_LAND)
    refused = {reason: count for reason, count in ground.link.rejected.items() if reason.startswith("rider_")}
    assert sum(refused.values()) == 2, refused
    assert "rider_internal" not in refused


def test_a_stop_passes_behind_a_frame_of_no_use_in_one_datagram(ground):
    stranger = bytearray(ground.station_says.encode(HEARTBEAT))
    stranger[7:10] = (60_001).to_bytes(3, "little")  # of another dialect
    damaged = bytearray(ground.station_says.encode(command(MavCmd.NAV_LAND)))
    damaged[-1] ^= 1
    ground.send_raw(bytes(stranger + damaged) + ground.station_says.encode(command(MavCmd.NAV_LAND)))
    assert message_of(ground.vehicle) == command(MavCmd.NAV_LAND)
    assert ground.link.rejected["rider_checksum"] == 1


def test_a_station_with_mavlink_1_is_told_that_its_stops_do_not_pass(ground):
    for _ in range(3):
        ground.send_raw(ground.station_says.encode(command(MavCmd.NAV_LAND), old=True))
    eventually(lambda: ground.told)
    nothing_comes(ground.vehicle)
    assert ground.told == ["drone_2: a second ground station speaks MAVLink 1: its stops do not pass"]


def test_parameters_pass_where_the_field_allows_them_50_a_second_and_stops_beyond(request):
    ground = Ground(allows=("parameters",))
    request.addfinalizer(ground.close)
    for _ in range(80):
        ground.order(ParamRequestList(11, 1))
    ground.order(command(MavCmd.NAV_LAND))
    came = [message_of(ground.vehicle) for _ in range(51)]
    assert came[-1] == command(MavCmd.NAV_LAND) or isinstance(came[-1], ParamRequestList)
    assert sum(isinstance(message, ParamRequestList) for message in came) >= 50
    eventually(lambda: ground.told)
    assert ground.link.rejected["rider_too_many"] >= 20


KEY = bytes(range(32))


def test_on_a_signed_link_only_a_signed_stop_passes_and_another_is_told_so(request):
    ground = Ground(key=KEY)
    request.addfinalizer(ground.close)
    for _ in range(2):
        ground.order(command(MavCmd.NAV_LAND))
    eventually(lambda: ground.told)
    ground.station_says = FrameEncoder(255, 190, Signing(bytes(32), 0))
    ground.order(command(MavCmd.NAV_LAND), command(MavCmd.REQUEST_MESSAGE, 148.0))
    eventually(lambda: ground.told[1:])
    nothing_comes(ground.vehicle)
    stop = "drone_2: a second ground station's stop (LAND)"
    assert ground.told == [
        f"{stop} is not signed and does not pass",
        f"{stop} is signed with another key and does not pass",
    ]
    assert ground.link.rejected["rider_unsigned"] == ground.link.rejected["rider_signature"] == 2
    ground.station_says = FrameEncoder(255, 190, Signing(KEY, 0))
    ground.order(command(MavCmd.NAV_LAND))
    assert message_of(ground.vehicle) == command(MavCmd.NAV_LAND)
    assert eventually(lambda: ground.told[2:]) == ["drone_2: a second ground station stops it (LAND)"]


def test_the_driver_judges_by_the_key_of_its_link(tmp_path, request):
    (tmp_path / "key").write_bytes(KEY)
    (tmp_path / "key").chmod(0o600)
    vehicle, station = udp(), udp()
    ours = {"name": "drone_2", "system_id": 11, "flavour": "ardupilot"}
    link = {"target": "udpout:{}:{}".format(*vehicle.getsockname()), "key_file": str(tmp_path / "key")}
    settings = MavlinkDriverSettings.model_validate(
        {"link": link, "vehicles": [ours | {"forward": f"udp:127.0.0.1:{station.getsockname()[1]}"}]}
    )
    process = FakeProcess(MemoryBus(MemoryExchange(), "lab", "mavlink"))
    fleet = Fleet(process, settings)
    for end in (station.close, vehicle.close, fleet.close):
        request.addfinalizer(end)
    fleet.link.send(11, HEARTBEAT)
    _, here = vehicle.recvfrom(2048)
    vehicle.sendto(FrameEncoder(11, 1, Signing(KEY, SigningClock().stamp())).encode(HEARTBEAT), here)
    _, rider = station.recvfrom(2048)
    station.sendto(FrameEncoder(255, 190).encode(command(MavCmd.NAV_LAND)), rider)
    eventually(lambda: fleet._news)
    fleet.turn(clock.now_ns())
    assert process.texts == ["drone_2: a second ground station's stop (LAND) is not signed and does not pass"]
