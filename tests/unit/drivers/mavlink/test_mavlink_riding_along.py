"""A second ground station may query and stop; messages that fly, feed or configure a vehicle are not forwarded."""

import math
import struct

import pytest

from drivers.mavlink.riding_along import Passage, made_good, may_pass, passage_of, words_of
from drivers.mavlink.wire import flight, service, telemetry
from drivers.mavlink.wire.event_request import REQUEST_EVENT
from drivers.mavlink.wire.frames import CLASSES, IDS, id_of
from drivers.mavlink.wire.names import FORCE, CopterMode, Flavour, MavCmd, Px4Auto, Px4Main, px4_mode

SYSTEM, MAY_PASS = 11, ("PARAM_REQUEST", "PARAM_SET", "MISSION_")
STOPS = (
    (MavCmd.NAV_LAND,),
    (MavCmd.DO_FLIGHTTERMINATION, 1.0),
    (MavCmd.COMPONENT_ARM_DISARM, 0.0),
    (MavCmd.COMPONENT_ARM_DISARM, 0.0, FORCE),
    (MavCmd.DO_PAUSE_CONTINUE, 0.0),
)


def command(number, *values, system=SYSTEM):
    return flight.CommandLong(system, 1, number, 0, *(float(value) for value in values))


def judged(message, flavour=Flavour.PX4, allowed=()):
    return passage_of(id_of(type(message)), message, SYSTEM, flavour, allowed)


@pytest.mark.parametrize("flavour", Flavour)
@pytest.mark.parametrize("order", STOPS)
def test_every_way_to_stop_passes(order, flavour):
    assert judged(command(*order), flavour) is Passage.STOP


def test_modes_that_stop_pass_and_others_are_refused():
    hold = (1, Px4Main.AUTO, Px4Auto.HOLD)
    assert judged(command(MavCmd.DO_SET_MODE, *hold)) is Passage.STOP
    assert judged(command(MavCmd.DO_SET_MODE, 1, Px4Main.AUTO, Px4Auto.MISSION)) is Passage.REFUSE
    assert judged(command(MavCmd.DO_SET_MODE, 1, Px4Main.OFFBOARD)) is Passage.REFUSE
    assert judged(command(MavCmd.DO_SET_MODE, 1, CopterMode.BRAKE), Flavour.ARDUPILOT) is Passage.STOP
    assert judged(command(MavCmd.DO_SET_MODE, 1, CopterMode.GUIDED), Flavour.ARDUPILOT) is Passage.REFUSE
    assert judged(command(MavCmd.DO_SET_MODE, 1, float("nan"))) is Passage.REFUSE
    landing = flight.SetMode(SYSTEM, 1, px4_mode(Px4Main.AUTO, Px4Auto.LAND))
    assert judged(landing) is Passage.STOP
    assert judged(landing._replace(base_mode=4)) is Passage.DROP
    assert judged(landing._replace(custom_mode=px4_mode(Px4Main.OFFBOARD))) is Passage.DROP


@pytest.mark.parametrize("base", [0, 4, 64, -1, 256, float("nan"), float("inf")])
def test_a_mode_that_a_px4_would_take_from_the_base_mode_is_no_stop(base):
    assert judged(command(MavCmd.DO_SET_MODE, base, Px4Main.AUTO, Px4Auto.HOLD)) is Passage.REFUSE


@pytest.mark.parametrize("kind", [flight.MissionItem, flight.MissionItemInt])
def test_a_point_of_a_mission_passes_unless_the_vehicle_would_fly_there_at_once(kind):
    point = kind(SYSTEM, 1, 0, 3, 16, 0, 1, 0.0, 0.0, 0.0, 0.0, 1, 1, 2.0)
    assert judged(point, Flavour.ARDUPILOT) is Passage.DROP
    assert judged(point, Flavour.ARDUPILOT, ("missions",)) is Passage.PASS
    for flown_to in (2, 3):
        assert judged(point._replace(current=flown_to), Flavour.ARDUPILOT, ("missions",)) is Passage.REFUSE


@pytest.mark.parametrize("number", [MavCmd.NAV_TAKEOFF, MavCmd.NAV_RETURN_TO_LAUNCH, MavCmd.SET_MESSAGE_INTERVAL, 300])
def test_other_commands_are_refused(number):
    assert judged(command(number, 1.0)) is Passage.REFUSE
    assert judged(command(MavCmd.COMPONENT_ARM_DISARM, 1.0)) is Passage.REFUSE


def test_a_command_for_another_vehicle_does_not_pass():
    assert judged(command(MavCmd.NAV_LAND, system=12)) is Passage.DROP
    assert judged(command(MavCmd.NAV_LAND, system=0)) is Passage.STOP


def test_no_other_kind_passes_unasked_and_parameters_and_missions_only_where_allowed():
    own = {
        id_of(kind) for kind in (flight.CommandLong, flight.CommandInt, flight.SetMode, service.FileTransferProtocol)
    }
    for name, number in IDS.items():
        if number in own:
            continue
        assert passage_of(number, None, SYSTEM, Flavour.PX4) is Passage.DROP
        assert not may_pass(number) and may_pass(number, ("parameters", "missions")) == name.startswith(MAY_PASS)
        allowed = passage_of(number, None, SYSTEM, Flavour.PX4, ("parameters", "missions"))
        assert (allowed is Passage.PASS) == name.startswith(MAY_PASS)
    assert all(map(may_pass, own))
    assert {"HEARTBEAT", "TIMESYNC", "SET_POSITION_TARGET_LOCAL_NED", "ODOMETRY"} <= CLASSES.keys()
    asked = service.ParamRequestList(SYSTEM, 1)
    assert judged(asked) is Passage.DROP
    assert judged(asked, allowed=("parameters",)) is Passage.PASS
    assert judged(telemetry.Heartbeat(6, 8, 0, 0, 4), allowed=("parameters",)) is Passage.DROP


PAUSE = (-1.0, 1.0, 0.0, math.nan, math.nan, math.nan, math.nan)  # as QGroundControl pauses a PX4


def test_qgroundcontrols_pause_of_a_px4_stops_and_no_other_reposition_passes():
    assert judged(command(MavCmd.DO_REPOSITION, *PAUSE)) is Passage.STOP
    assert judged(command(MavCmd.DO_REPOSITION, *PAUSE), Flavour.ARDUPILOT) is Passage.REFUSE
    for place in (1, 3, 4, 5, 6):
        moved = (*PAUSE[:place], 0.0, *PAUSE[place + 1 :])
        assert judged(command(MavCmd.DO_REPOSITION, *moved)) is Passage.REFUSE
    elsewhere = flight.CommandInt(SYSTEM, 1, 0, MavCmd.DO_REPOSITION, 0, 0, -1.0, 1.0, 0.0, math.nan, 0, 0, math.nan)
    assert judged(elsewhere) is Passage.REFUSE


def test_a_pause_of_an_ardupilot_ends_in_a_mode_that_is_seen_and_other_stops_need_nothing():
    brake = command(MavCmd.DO_SET_MODE, 1, CopterMode.BRAKE)
    assert made_good(command(MavCmd.DO_PAUSE_CONTINUE, 0.0), SYSTEM, Flavour.ARDUPILOT) == brake
    assert made_good(command(MavCmd.DO_PAUSE_CONTINUE, 0.0), SYSTEM, Flavour.PX4) is None
    assert made_good(command(MavCmd.NAV_LAND), SYSTEM, Flavour.ARDUPILOT) is None
    assert made_good(flight.SetMode(SYSTEM, 1, CopterMode.LAND), SYSTEM, Flavour.ARDUPILOT) is None


@pytest.mark.parametrize(
    ("stop", "flavour", "words"),
    [
        (command(MavCmd.NAV_LAND), Flavour.PX4, "LAND"),
        (command(MavCmd.DO_SET_MODE, 1, Px4Main.AUTO, Px4Auto.HOLD), Flavour.PX4, "HOLD"),
        (command(MavCmd.DO_SET_MODE, 1, CopterMode.BRAKE), Flavour.ARDUPILOT, "BRAKE"),
        (flight.SetMode(1, 1, 9), Flavour.ARDUPILOT, "LAND"),
        (command(MavCmd.DO_REPOSITION, *PAUSE), Flavour.PX4, "pause"),
        (command(MavCmd.COMPONENT_ARM_DISARM, 0.0), Flavour.PX4, "disarm"),
        (command(MavCmd.COMPONENT_ARM_DISARM, 0.0, FORCE), Flavour.PX4, "motors off"),
        (command(MavCmd.DO_FLIGHTTERMINATION, 1.0), Flavour.PX4, "flight termination"),
    ],
)
def test_a_stop_is_told_in_words(stop, flavour, words):
    assert words_of(stop, flavour) == words


@pytest.mark.parametrize(
    ("first", "last", "system", "passage"),
    [
        (7, 7, SYSTEM, Passage.PASS),
        (0, 0, SYSTEM, Passage.PASS),
        (65535, 65535, SYSTEM, Passage.PASS),
        (65535, 0, SYSTEM, Passage.DROP),
        (8, 7, SYSTEM, Passage.DROP),
        (0, 1, SYSTEM, Passage.DROP),
        (7, 7, SYSTEM + 1, Passage.DROP),
    ],
    ids=["one", "the first", "the last", "two across the end", "all 65536", "two", "of another vehicle"],
)
def test_it_may_ask_for_one_event_at_a_time_that_it_has_missed(first, last, system, passage):
    payload = struct.pack("<HHBB", first, last, system, 1)
    raw = bytes((0xFD, len(payload), 0, 0, 0, 255, 190)) + REQUEST_EVENT.to_bytes(3, "little") + payload + b"\0\0"
    assert may_pass(REQUEST_EVENT)
    assert passage_of(REQUEST_EVENT, None, SYSTEM, Flavour.PX4, raw=raw) is passage
