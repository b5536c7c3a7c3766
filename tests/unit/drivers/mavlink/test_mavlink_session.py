"""Reading parameters: one unknown to the firmware is named, and the others are still read."""

import math

from drivers.mavlink.identity import serial_number_of
from drivers.mavlink.parameters import needed
from drivers.mavlink.requests import Requests
from drivers.mavlink.session import MavlinkSession
from drivers.mavlink.settings import GlobalOrigin
from drivers.mavlink.wire.flight import CommandAckMessage
from drivers.mavlink.wire.frames import id_of
from drivers.mavlink.wire.names import Flavour
from drivers.mavlink.wire.parameters import REAL32
from drivers.mavlink.wire.service import ParamRequestRead, ParamValue
from drivers.mavlink.wire.telemetry import (
    OUR_HEARTBEAT,
    Attitude,
    AutopilotVersion,
    BatteryStatus,
    ExtendedSysState,
)

MS = 1_000_000


def read_all(strange: set[str], seconds: float) -> MavlinkSession:
    """A vehicle that answers for every parameter but the unknown ones."""
    session, requests = MavlinkSession(1, Flavour.ARDUPILOT, {}, 255, GlobalOrigin()), Requests(1)
    values = {n.name: n.value for n in needed(Flavour.ARDUPILOT, 255)}
    for turn in range(round(seconds * 100)):
        for message in session.step(10_000 * MS + turn * 10 * MS, 0, requests):
            if isinstance(message, ParamRequestRead) and message.param_id in values.keys() - strange:
                session.hear_parameter(ParamValue(message.param_id, values[message.param_id], REAL32, 1, 0))
    return session


def test_eight_heartbeats_go_out_in_the_time_after_which_an_ardupilot_lands_without() -> None:
    session, requests = MavlinkSession(1, Flavour.ARDUPILOT, {}, 255, GlobalOrigin()), Requests(1)
    (lands_s,) = (n.value for n in needed(Flavour.ARDUPILOT, 255) if n.name == "FS_GCS_TIMEOUT")
    sent = [m for turn in range(round(lands_s * 100)) for m in session.step(10_000 * MS + turn * 10 * MS, 0, requests)]
    assert lands_s == 2.0 and sent.count(OUR_HEARTBEAT) == 8


def test_a_vehicle_that_was_never_heard_may_be_one_that_calls() -> None:
    session, requests = MavlinkSession(1, Flavour.PX4, {}, 255, GlobalOrigin(), called=True), Requests(1)
    assert session.detail(requests) == (
        "waiting for its heartbeat; if it calls this computer, it needs mavlink.listen: true"
    )
    session.step(10_000 * MS, 0, requests)
    session.start_over(requests)
    assert session.detail(requests) == "waiting for its heartbeat", "it was reached"


def test_unknown_parameters_do_not_hide_the_others() -> None:
    first = [n.name for n in needed(Flavour.ARDUPILOT, 255)][:5]
    assert read_all(set(first), 15.0).unread == first
    assert read_all(set(), 5.0).unread == []


def test_a_parameter_that_is_never_answered_is_named_with_the_firmware() -> None:
    session = read_all({"GPS1_TYPE"}, 3.0)
    assert session.detail(Requests(1)) == "reading parameter GPS1_TYPE"
    session = read_all({"GPS1_TYPE"}, 15.0)
    session.hear_version(0x04060200)
    assert "does not know parameter GPS1_TYPE" in session.detail(Requests(1))


def test_a_parameter_that_a_firmware_need_not_have_grounds_nobody() -> None:
    session = read_all({"VISO_SCALE"}, 15.0)
    session.hear_version(0x04060200)
    session.hear_origin()
    assert session.detail(Requests(1)) == ""
    assert "not checked, because its firmware does not know them: VISO_SCALE" in session.notes


def test_a_vehicle_with_another_serial_number_is_not_ready() -> None:
    session = MavlinkSession(1, Flavour.PX4, {}, 255, GlobalOrigin(), pinned="0a0B")
    requests = Requests(1)
    asked = [m for turn in range(3000) for m in session.step(10_000 * MS + turn * 10 * MS, 0, requests)]
    assert sum(getattr(m, "param1", 0) == 148 for m in asked) > 10, "it goes on asking for the number"
    assert session.detail(requests) == "it is another vehicle: its serial number is not known, the field says 0A0B"
    session.hear_version(0x01100000, "0C0D")
    assert "its serial number is 0C0D" in session.detail(requests)
    session.hear_version(0x01100000, "0A0B")
    assert "another vehicle" not in session.detail(requests)
    session.step(10**12, 10**11, requests)
    session.step(10**12 + 10**9, 0, requests)
    assert "not known" in session.detail(requests), "after a silence it may be another one"


def test_the_serial_number_is_uid2_or_else_uid() -> None:
    assert serial_number_of(AutopilotVersion(0, 0, uid=0xAB)) == "00000000000000AB"
    assert serial_number_of(AutopilotVersion(0, 0, uid=0xAB, uid2=(1, 255, *(0,) * 16))) == "01FF" + "00" * 16
    assert serial_number_of(AutopilotVersion(0, 0)) == ""


def test_an_older_or_newer_name_counts_as_well() -> None:
    session, requests = MavlinkSession(1, Flavour.ARDUPILOT, {}, 255, GlobalOrigin()), Requests(1)
    values = {n.aliases[0] if n.aliases else n.name: n.value for n in needed(Flavour.ARDUPILOT, 255)}
    for turn in range(1500):
        for message in session.step(10_000 * MS + turn * 10 * MS, 0, requests):
            if isinstance(message, ParamRequestRead) and message.param_id in values:
                session.hear_parameter(ParamValue(message.param_id, values[message.param_id], REAL32, 1, 0))
    assert "GPS_TYPE" in values and "MAV_GCS_SYSID" in values
    assert not session.unread and not session.problems


def test_a_copter_of_4_7_is_read_by_its_own_names() -> None:
    session, requests = MavlinkSession(1, Flavour.ARDUPILOT, {}, 255, GlobalOrigin()), Requests(1)
    session.hear_version(0x04070000)
    session.hear_origin()
    values = {n.name: n.value for one in needed(Flavour.ARDUPILOT, 255) for n in (one.successor or one,)}
    values["LAND_SPD_MS"] = 0.5
    for turn in range(1500):
        for message in session.step(10_000 * MS + turn * 10 * MS, 0, requests):
            if isinstance(message, ParamRequestRead) and message.param_id in values:
                session.hear_parameter(ParamValue(message.param_id, values[message.param_id], REAL32, 1, 0))
    assert "ARMING_SKIPCHK" in values and not session.unread and not session.problems
    assert session.detail(requests) == ""
    (told,) = session.notes
    assert told.startswith("parameter LAND_SPD_MS is 0.5, needs 0.6 to 1 (")
    session.hear_parameter(ParamValue("ARMING_SKIPCHK", 64.0, REAL32, 1, 0))
    assert session.notes[-1].startswith("somebody changed its parameter ARMING_SKIPCHK from 0 to 64, needs 0 (")
    assert session.problems[0].startswith("ARMING_SKIPCHK is 64, needs 0 (")


def test_a_value_that_setup_would_change_is_told_once_and_flown() -> None:
    session, requests = MavlinkSession(1, Flavour.ARDUPILOT, {}, 255, GlobalOrigin()), Requests(1)
    session.hear_origin()
    values = {n.name: n.value for n in needed(Flavour.ARDUPILOT, 255)} | {"LAND_SPEED": 50.0}
    for name, value in [*values.items(), *values.items()]:
        session.hear_parameter(ParamValue(name, value, REAL32, 1, 0))
    session.step(10_000 * MS, 0, requests)
    assert session.detail(requests) == "" and not session.problems
    (told,) = session.notes
    assert told.startswith("parameter LAND_SPEED is 50, needs 60 to 100 (") and told.endswith("setup --apply")


def test_another_version_is_flown_and_what_was_not_checked_is_said() -> None:
    session, requests = MavlinkSession(1, Flavour.ARDUPILOT, {}, 255, GlobalOrigin()), Requests(1)
    session.hear_origin()
    assert session.firmware == ""
    session.hear_version(0x04080000)
    assert session.firmware == "ArduPilot 4.8"
    values = {n.name: n.value for n in needed(Flavour.ARDUPILOT, 255) if n.name != "FS_EKF_ACTION"}
    for turn in range(1500):
        for message in session.step(10_000 * MS + turn * 10 * MS, 0, requests):
            if isinstance(message, ParamRequestRead) and message.param_id in values:
                session.hear_parameter(ParamValue(message.param_id, values[message.param_id], REAL32, 1, 0))
    assert session.detail(requests) == ""
    assert "4.8" in session.notes[0]
    assert session.notes[1] == "not checked, because its firmware does not know them: FS_EKF_ACTION"
    assert len(session.notes) == 2


def test_no_version_told_at_all_is_another_version() -> None:
    session = read_all({"FS_EKF_ACTION"}, 20.0)
    session.hear_origin()
    assert session.detail(Requests(1)) == ""


class Streamer:
    """A vehicle that grants each stream, and sends all but those to be withheld."""

    def __init__(self) -> None:
        rates: dict[type, float] = {ExtendedSysState: 5.0, BatteryStatus: 1.0, Attitude: 0.0}
        self.session, self.requests = MavlinkSession(1, Flavour.PX4, rates, 255, GlobalOrigin()), Requests(1)
        self.asked: list[int] = []
        self.kept_back: set[type] = set()
        self._turn = 0

    def live(self, seconds: float) -> list[int]:
        """Return the ids of the messages whose rate was requested meanwhile."""
        before = len(self.asked)
        for _ in range(round(seconds * 50)):
            self._turn += 1
            now_ns = 10_000 * MS + self._turn * 20 * MS
            for kind in {ExtendedSysState, BatteryStatus} - self.kept_back:
                if self._turn % 10 == 0:
                    self.session.take(now_ns, kind)
            self.session.step(now_ns, 0, self.requests)
            for command in self.requests.due(now_ns):
                self.asked.append(int(command.param1))
                self.requests.answer(now_ns, CommandAckMessage(command.command, 0))
        return self.asked[before:]


def test_a_stream_that_does_not_come_or_has_ended_is_asked_for_again() -> None:
    """A restart of less than 2 s, another station's rates, or the answer to another request: no silence."""
    vehicle = Streamer()
    vehicle.kept_back = {ExtendedSysState}  # granted, as far as the answer tells
    assert sorted(vehicle.live(2.0)) == sorted(map(id_of, (ExtendedSysState, BatteryStatus, Attitude)))
    assert vehicle.live(10.0).count(id_of(ExtendedSysState)) >= 2
    vehicle.kept_back.clear()
    vehicle.live(1.0)
    assert vehicle.live(20.0) == [], "what comes is not asked for"
    vehicle.kept_back = {BatteryStatus}
    assert set(vehicle.live(8.0)) == {id_of(BatteryStatus)}
    assert "asking for" not in vehicle.session.detail(vehicle.requests), "it stays as ready as it was"


def test_after_a_restart_everything_is_asked_for_anew() -> None:
    vehicle = Streamer()
    vehicle.live(3.0)
    vehicle.session.hear_origin()
    vehicle.session.start_over(vehicle.requests)
    assert vehicle.session.detail(vehicle.requests) == "waiting for its heartbeat"
    assert sorted(vehicle.live(4.0)) == sorted(map(id_of, (ExtendedSysState, BatteryStatus, Attitude)))


def test_a_parameter_that_somebody_else_changes_is_told_once_with_its_need() -> None:
    session = read_all(set(), 5.0)
    session.notes.clear()
    for value in (10.0, 10.0):
        session.hear_parameter(ParamValue("GUID_TIMEOUT", value, REAL32, 1, 0))
    (told,) = session.notes
    assert told.startswith("somebody changed its parameter GUID_TIMEOUT from 0.5 to 10, needs 0.1 to 0.5")
    session.hear_parameter(ParamValue("GUID_TIMEOUT", 0.4, REAL32, 1, 0))
    assert session.notes[-1].endswith("from 10 to 0.4")


def test_a_parameter_that_is_no_number_is_told_and_forbids_a_take_off() -> None:
    """A PX4 takes one from any station, and keeps it."""
    session, requests = MavlinkSession(1, Flavour.PX4, {}, 255, GlobalOrigin()), Requests(1)
    for needed_one in needed(Flavour.PX4, 255):
        if needed_one.kind == REAL32:
            session.hear_parameter(ParamValue(needed_one.name, needed_one.value, REAL32, 1, 0))
    for _ in range(2):
        session.hear_parameter(ParamValue("COM_OF_LOSS_T", math.nan, REAL32, 1, 0))
    session.step(10_000 * MS, 0, requests)
    assert session.problems[0].startswith("COM_OF_LOSS_T is nan, needs 0.3 to 1")
    assert [text[:60] for text in session.notes] == ["somebody changed its parameter COM_OF_LOSS_T from 0.5 to nan"]


def test_only_where_the_loss_of_a_transmitter_is_told_is_there_a_pilot() -> None:
    session, requests = MavlinkSession(1, Flavour.ARDUPILOT, {}, 255, GlobalOrigin()), Requests(1)
    assert not session.tells_lost_transmitter, "as long as it is not known"
    session.hear_parameter(ParamValue("FS_THR_ENABLE", 3.0, REAL32, 1, 0))
    session.step(10**12, 0, requests)
    session.start_over(requests)
    assert session.tells_lost_transmitter, "a silence does not change it"
    session.hear_parameter(ParamValue("FS_THR_ENABLE", 0.0, REAL32, 1, 0))
    assert not session.tells_lost_transmitter
    assert MavlinkSession(1, Flavour.PX4, {}, 255, GlobalOrigin()).tells_lost_transmitter


def test_a_transmitter_whose_loss_is_not_told_is_warned_of_once() -> None:
    session = MavlinkSession(1, Flavour.ARDUPILOT, {}, 255, GlobalOrigin())
    session.hear_parameter(ParamValue("FS_THR_ENABLE", 0.0, REAL32, 1, 0))
    assert not session.notes, "without a receiver it has to be 0"
    session.hear_transmitter()
    session.hear_transmitter()
    (told,) = session.notes
    assert "FS_THR_ENABLE is 0, needs 3 (" in told and not session.problems
