"""Malformed orders to the emulated autopilots, answered as by a PX4 1.16 and by the sources of ArduPilot 4.5."""

import math
import struct
from typing import NamedTuple

import pytest
from mavlink_bench import Bench

from drivers.mavlink.wire import flight as f
from drivers.mavlink.wire import service as s
from drivers.mavlink.wire import telemetry as t
from drivers.mavlink.wire.frames import FrameEncoder
from drivers.mavlink.wire.names import CopterMode

NAN, INF = math.nan, math.inf
ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED = 0, 1, 2, 3, 4
OFFBOARD, HOLD, POSITION = 6 << 16, 4 << 16 | 3 << 24, 3 << 16
ARM, MODE, INTERVAL, REQUEST, PAUSE, HOME, TAKE_OFF = 400, 176, 511, 512, 193, 179, 22
ATTITUDE, HEARTBEAT, UNHEARD = 30.0, 0.0, 12_345.0


@pytest.fixture
def bench(hand, flavour):
    return Bench(flavour).run(1.0)


def results(bench, *params, system=5, component=1):
    """Return the results of all acknowledgements of a command."""
    number, *rest = params
    bench.heard.clear()
    answers = bench.say(f.CommandLong(system, component, number, 0, *rest))
    return [m.result for m in answers if isinstance(m, f.CommandAckMessage)]


class Order(NamedTuple):
    """A command, with the results of its acknowledgements by a PX4 and an ArduPilot that stands disarmed."""

    params: tuple[float, ...]
    px4: list[int]
    ardupilot: list[int]


ORDERS = {
    "arming by 2": Order((ARM, 2.0), [], [UNSUPPORTED]),
    "arming by a half": Order((ARM, 0.4), [ACCEPTED], [UNSUPPORTED]),
    "arming by no number": Order((ARM, NAN), [ACCEPTED], [UNSUPPORTED]),  # a PX4 disarms
    "arming by -1": Order((ARM, -1.0), [], [UNSUPPORTED]),
    "no such mode": Order((MODE, 1.0, 99.0), [ACCEPTED], [FAILED]),
    "no such automatic mode": Order((MODE, 1.0, 4.0, 77.0), [REJECTED], [ACCEPTED]),
    "a packed mode": Order((MODE, 1.0, float(OFFBOARD)), [ACCEPTED], [FAILED]),
    "a mode without its flag": Order((MODE, 0.0, 6.0), [ACCEPTED], [DENIED]),
    "no base mode": Order((MODE, NAN, 6.0), [ACCEPTED], [DENIED]),
    "a mission that is not there": Order((MODE, 1.0, 4.0, 4.0), [ACCEPTED], [ACCEPTED]),
    "a rate of heartbeats": Order((INTERVAL, HEARTBEAT, 1e5), [FAILED], [ACCEPTED]),
    "a rate of nothing": Order((INTERVAL, UNHEARD, 1e5), [FAILED], [DENIED]),
    "a rate of no number": Order((INTERVAL, NAN, 1e5), [FAILED], [ACCEPTED]),  # 0, the heartbeat
    "a rate for others": Order((INTERVAL, ATTITUDE, 1e5, 0.0, 0.0, 0.0, 0.0, 2.0), [FAILED], [ACCEPTED]),
    "an interval that is none": Order((INTERVAL, ATTITUDE, NAN), [ACCEPTED], [ACCEPTED]),
    "a message that is none": Order((REQUEST, UNHEARD), [DENIED], [FAILED]),
    "a message of no number": Order((REQUEST, NAN), [ACCEPTED], [ACCEPTED]),  # 0, the heartbeat
    "an origin before it is set": Order((REQUEST, 49.0), [DENIED], [ACCEPTED]),
    "neither pause nor resume": Order((PAUSE, 7.0), [UNSUPPORTED], [DENIED]),
    "a home nowhere": Order((HOME, 0.0, 0.0, 0.0, 0.0, NAN, NAN, NAN), [DENIED], [DENIED]),
    "take-off to nowhere": Order((TAKE_OFF, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, NAN), [ACCEPTED], [FAILED]),
    "an integer's nowhere as a float": Order(
        (TAKE_OFF, 0.0, 0.0, 0.0, 0.0, 2147483647.0, 2147483647.0, 1.0), [DENIED], [FAILED]
    ),
}


@pytest.mark.parametrize("name", ORDERS)
def test_a_malformed_command_is_answered_as_by_the_firmware(bench, flavour, name):
    order = ORDERS[name]
    if name == "neither pause nor resume":
        bench.firmware.mode = bench.firmware.guided
    assert results(bench, *order.params) == getattr(order, flavour)
    assert not bench.firmware.armed


def test_an_odd_arming_order_is_told_by_a_text_of_the_px4(hand):
    bench = Bench("px4").run(1.0)
    assert results(bench, ARM, 2.0) == []
    assert "Unsupported ARM_DISARM param: 2.000" in bench.run(0.1).texts()


def test_an_order_that_is_no_number_disarms_no_px4_in_the_air(hand):
    bench = Bench("px4").up()
    assert results(bench, ARM, NAN) == [REJECTED]
    assert bench.firmware.armed and bench.copter.airborne


def test_no_unknown_mode_changes_the_mode(bench, flavour):
    before = bench.firmware.mode
    for params in ((1.0, 99.0), (1.0, 4.0, 77.0) if flavour == "px4" else (1.0, 77.0), (0.0, 4.0), (NAN, 6.0)):
        results(bench, MODE, *params)
        assert bench.firmware.mode == before
    if flavour == "ardupilot":
        assert "No such mode 99" in bench.run(0.1).texts()


def test_a_mode_of_no_number_is_mode_0_of_an_ardupilot(hand):
    bench = Bench("ardupilot").run(1.0)
    bench.firmware.enter(CopterMode.LOITER)
    assert results(bench, MODE, 1.0, NAN) == [ACCEPTED] and bench.firmware.mode == CopterMode.STABILIZE


def test_flags_of_the_base_mode_count_for_a_px4(hand):
    bench = Bench("px4").run(1.0)
    assert results(bench, MODE, 64.0 + 8.0) == [ACCEPTED] and bench.firmware.mode == POSITION


def test_set_mode_is_answered_once_by_a_px4_and_not_by_an_ardupilot(bench, flavour):
    px4 = flavour == "px4"
    answers = bench.say(f.SetMode(5, 1, POSITION if px4 else CopterMode.ALT_HOLD))
    assert [m.result for m in answers if isinstance(m, f.CommandAckMessage)] == ([ACCEPTED] if px4 else [])
    assert bench.firmware.mode == (POSITION if px4 else CopterMode.ALT_HOLD)
    assert not bench.say(f.SetMode(5, 0, 99)) or px4
    assert bench.firmware.mode == (POSITION if px4 else CopterMode.ALT_HOLD)


# -- for whom --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("system", "component", "px4", "ardupilot"),
    [
        (77, 1, [], []),
        (77, 0, [], []),
        (5, 0, [UNSUPPORTED], [UNSUPPORTED]),
        (0, 0, [], [UNSUPPORTED]),
        (0, 1, [], [UNSUPPORTED]),
        (5, 100, [], [UNSUPPORTED]),  # an ArduPilot has heard no component 100
    ],
)
def test_orders_to_others_are_not_answered(bench, flavour, system, component, px4, ardupilot):
    expected = px4 if flavour == "px4" else ardupilot
    assert results(bench, 31010, system=system, component=component) == expected


def test_capabilities_are_told_to_everybody_who_asks_all(bench):
    assert results(bench, 520, system=0, component=77) == [ACCEPTED]


def test_an_autopilot_does_not_obey_itself(bench):
    bench.encoder = FrameEncoder(5, 1)
    assert results(bench, 31010) == []


# -- rates -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("interval_us", "px4", "ardupilot"),
    [
        (-1.0, None, None),
        (-7.0, None, 1),  # a millisecond to ArduPilot
        (0.0, 2, None),  # its default rate
        (NAN, 2, None),
        (1.0, 1, 1),  # no faster than its loop
        (1e5, 20, 20),
        (7e7, 14_000, 12_000),
    ],
)
def test_odd_intervals(bench, flavour, interval_us, px4, ardupilot):
    bench.say(f.CommandLong(5, 1, INTERVAL, 0, ATTITUDE, 50_000.0))
    assert results(bench, INTERVAL, ATTITUDE, interval_us) == [ACCEPTED]
    channel = bench.emulator.channel(("127.0.0.1", 14999))
    assert channel.rates.intervals.get(t.Attitude) == (px4 if flavour == "px4" else ardupilot)


# -- parameters ------------------------------------------------------------------------------------------------------


def carried(flavour, value):
    return struct.unpack("<f", struct.pack("<i", value))[0] if flavour == "px4" else float(value)


def names_of(flavour):
    return ("EKF2_HGT_REF", "EKF2_EV_DELAY") if flavour == "px4" else ("FS_OPTIONS", "GUID_TIMEOUT")


def test_a_parameter_of_a_wrong_type_is_refused_by_a_px4_in_silence(bench, flavour):
    integer, real = names_of(flavour)
    before = dict(bench.firmware.parameters.values)
    for name, kind in ((integer, 9), (real, 6), (real, 99)):
        answers = bench.say(s.ParamSet(5, 1, name, carried(flavour, 3) if kind == 9 else 2.0, kind))
        assert bool(answers) is (flavour == "ardupilot")
    assert (bench.firmware.parameters.values == before) is (flavour == "px4")


@pytest.mark.parametrize("value", [NAN, INF])
def test_a_parameter_that_is_no_number_is_taken_by_a_px4_alone(bench, flavour, value):
    _, real = names_of(flavour)
    before = bench.firmware.parameters[real]
    answers = bench.say(s.ParamSet(5, 1, real, value, 9))
    assert (bench.firmware.parameters[real] == before) is (flavour == "ardupilot")
    assert [str(m.param_value) for m in answers] == ([str(value)] if flavour == "px4" else [])


def test_unknown_parameters_are_neither_set_nor_read(bench):
    count = len(bench.firmware.parameters.names)
    assert bench.say(s.ParamSet(5, 1, "NO_SUCH", 1.0, 6)) == []
    for name, index in (("NO_SUCH", -1), ("", count), ("", 32767)):
        assert bench.say(s.ParamRequestRead(5, 1, name, index)) == []


def test_an_index_below_minus_one_means_the_name_to_a_px4(bench, flavour):
    assert bool(bench.say(s.ParamRequestRead(5, 1, names_of(flavour)[0], -2))) is (flavour == "px4")


# -- setpoints -------------------------------------------------------------------------------------------------------


def speed_after(bench, **setpoint):
    bench.fly(forward=0.6)
    bench.run(2.0)
    bench.fly(**setpoint)
    bench.run(0.4)
    bench.heard.clear()
    bench.run(1.0)
    return abs(bench.copter.airframe.vx)


@pytest.mark.parametrize(
    ("setpoint", "text"),
    [
        ({"frame": 12}, "SET_POSITION_TARGET_LOCAL_NED coordinate frame 12"),
        ({"frame": 255}, "SET_POSITION_TARGET_LOCAL_NED coordinate frame 255"),
        ({"mask": 0xFFF}, "SET_POSITION_TARGET_LOCAL_NED invalid"),
        ({"mask": 0xDFF}, "SET_POSITION_TARGET_LOCAL_NED invalid"),
        ({"mask": 0x5CF}, "SET_POSITION_TARGET_LOCAL_NED invalid"),  # one axis of three, in the body's frame
        ({"mask": 0x607}, "SET_POSITION_TARGET_LOCAL_NED force not supported"),
        ({"forward": NAN, "right": NAN, "down": NAN, "frame": 1}, "SET_POSITION_TARGET_LOCAL_NED invalid"),
    ],
)
def test_a_malformed_setpoint_is_no_setpoint_to_a_px4(hand, setpoint, text):
    bench = Bench("px4").up()
    bench.firmware.parameters.values["COM_OBL_RC_ACT"] = 0
    bench.fly(forward=0.6)
    bench.run(1.0)
    bench.fly(**setpoint)
    bench.run(2.0)
    assert text in bench.texts()
    assert bench.firmware.mode == POSITION, "without setpoints it leaves OFFBOARD"


def test_an_ignored_field_may_be_no_number(hand, flavour):
    bench = Bench(flavour).up()
    bench.setpoint = f.SetPositionTargetLocalNed(
        0, 5, 1, 8, 0xDC7, NAN, NAN, NAN, 0.6, 0.0, 0.0, NAN, NAN, NAN, NAN, NAN
    )
    bench.run(2.5)
    assert bench.copter.airframe.vx > 0.4


@pytest.mark.parametrize(
    "setpoint", [{"frame": 12}, {"mask": 0xFFF}, {"forward": NAN}, {"forward": 2000.0}, {"mask": 0x5CF}]
)
def test_a_malformed_setpoint_stops_an_ardupilot(hand, setpoint):
    assert speed_after(Bench("ardupilot").up(), **{"forward": 0.6, **setpoint}) < 0.2


def test_a_force_means_nothing_to_an_ardupilot(hand):
    """Its last velocity counts until GUID_TIMEOUT."""
    bench = Bench("ardupilot").up()
    bench.firmware.parameters.values["GUID_TIMEOUT"] = 5.0
    assert speed_after(bench, forward=0.0, mask=0x607) > 0.4


# -- clocks, origin, missions ----------------------------------------------------------------------------------------


def test_answers_to_no_question_of_its_own_do_not_set_its_clock(hand):
    bench = Bench("px4").run(1.0)
    clock = bench.emulator.channel(("127.0.0.1", 14999)).clock
    now_ns = bench.emulator.now_ns
    for tc1, ts1 in ((-5, now_ns), (7_000, now_ns + 5_000_000_000), (7_000, -1), (7_000, 0)):
        assert bench.say(s.Timesync(tc1, ts1)) == []
        assert clock.local_ns(123, now_ns) == now_ns
    assert [m.ts1 for m in bench.say(s.Timesync(0, -9))] == [-9]


def test_an_origin_off_the_earth_is_not_taken(bench):
    bench.run(1.5)
    assert bench.say(s.SetGpsGlobalOrigin(5, 910_000_000, 0, 0)) == []
    assert bench.say(s.SetGpsGlobalOrigin(5, 0, -1_810_000_000, 0)) == []
    assert bench.firmware.origin is None


def test_an_item_of_no_mission(bench, flavour):
    answers = bench.say(s.MissionRequestInt(5, 1, 7))
    assert [m.type for m in answers if isinstance(m, s.MissionAck)] == ([] if flavour == "px4" else [13])


def test_a_take_off_in_a_wrong_frame_is_denied_by_an_ardupilot(hand):
    bench = Bench("ardupilot").run(1.0)
    for frame, result in ((0, DENIED), (3, FAILED)):
        answers = bench.say(f.CommandInt(5, 1, frame, TAKE_OFF, 0, 0, 0.0, 0.0, 0.0, 0.0, 0, 0, 1.0))
        assert [m.result for m in answers if isinstance(m, f.CommandAckMessage)] == [result]


def test_no_number_among_integers_is_denied_by_a_px4(hand):
    bench = Bench("px4").run(1.0)
    answers = bench.say(f.CommandInt(5, 1, 0, 192, 0, 0, -1.0, 1.0, 0.0, NAN, 0x7FF80000, 0x7FF80000, NAN))
    assert [m.result for m in answers if isinstance(m, f.CommandAckMessage)] == [DENIED]
    answers = bench.say(f.CommandInt(5, 1, 0, 192, 0, 0, -1.0, 1.0, 0.0, NAN, 0x7FFFFFFF, 0x7FFFFFFF, NAN))
    assert [m.result for m in answers if isinstance(m, f.CommandAckMessage)] == [ACCEPTED]
    assert bench.firmware.mode == HOLD
