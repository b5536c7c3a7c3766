"""Places to which other programs send the emulated autopilots: MAVSDK, MAVROS, DroneKit, QGroundControl."""

import math

import pytest
from mavlink_bench import Bench

from drivers.mavlink.wire import flight as f
from drivers.mavlink.wire import service as s
from sim_bridge.devices.mavlink_places import DEGREE_M

LATITUDE, LONGITUDE, ALTITUDE = 473_977_420, 85_455_940, 488_000
HOLD, GUIDED, LOITER = 4 << 16 | 3 << 24, 4, 5
PLACE, PLACE_AND_YAW = 0x0DF8, 0x09F8
NAN = math.nan


@pytest.fixture
def bench_of(hand):
    def up(flavour):
        bench = Bench(flavour).run(2.5)
        bench.say(s.SetGpsGlobalOrigin(5, LATITUDE, LONGITUDE, ALTITUDE))
        return bench.up()

    return up


def on_earth(north, east):
    shrink = math.cos(math.radians(LATITUDE * 1e-7))
    return LATITUDE + round(north / DEGREE_M * 1e7), LONGITUDE + round(east / (DEGREE_M * shrink) * 1e7)


def local(place, frame=1, mask=PLACE, yaw=0.0):
    x, y, z = place
    return f.SetPositionTargetLocalNed(0, 5, 1, frame, mask, x, y, z, 0, 0, 0, 0, 0, 0, yaw, 0)


def reposition(bench, north, east, altitude, frame=5, flag=1.0, yaw=NAN):
    """MAVSDK's goto_location, with its frame; QGroundControl's has frame 0. Return the result."""
    latitude, longitude = on_earth(north, east)
    bench.say(f.CommandInt(5, 1, frame, 192, 0, 0, -1.0, flag, 0.0, yaw, latitude, longitude, altitude))
    return [m.result for m in bench.heard if isinstance(m, f.CommandAckMessage) and m.command == 192][-1]


def north_east_up(bench):
    body = bench.copter.airframe
    return pytest.approx((body.x, -body.y, body.z), abs=0.2)


def test_a_px4_flies_to_a_place_on_earth_in_hold_and_stops_when_it_is_sent_nowhere(bench_of):
    bench = bench_of("px4")
    assert reposition(bench, 3.0, -1.0, 490.0, yaw=1.0) == 0 and bench.firmware.mode == HOLD
    bench.run(8.0)
    assert north_east_up(bench) == (3.0, -1.0, 2.0) and bench.copter.airframe.yaw == pytest.approx(-1.0, abs=0.1)
    assert reposition(bench, -3.0, -1.0, 490.0, flag=0.0) == 3, "only with the flag of a change of mode"
    assert reposition(bench, -3.0, -1.0, 490.0) == 0
    bench.run(1.5)
    assert bench.copter.airframe.vx < -0.5
    assert bench.command(192, -1.0, 1.0, 0.0, NAN, NAN, NAN, NAN) == 0
    bench.run(8.0)
    assert abs(bench.copter.airframe.vx) < 0.1 and bench.copter.airframe.x > -2.0


def test_a_px4_in_offboard_flies_to_places_while_they_keep_coming(bench_of):
    bench = bench_of("px4")
    bench.setpoint = local((2.0, 1.0, -1.5), mask=PLACE_AND_YAW, yaw=0.5)
    bench.run(6.0)
    assert north_east_up(bench) == (2.0, 1.0, 1.5) and bench.copter.airframe.yaw == pytest.approx(-0.5, abs=0.1)
    latitude, longitude = on_earth(0.0, 0.0)
    bench.setpoint = f.SetPositionTargetGlobalInt(0, 0, 0, 6, PLACE, latitude, longitude, 1.0, 0, 0, 0, 0, 0, 0, 0, 0)
    bench.run(6.0)
    assert north_east_up(bench) == (0.0, 0.0, 1.0)
    bench.setpoint = local((5.0, 0.0, -1.0), frame=8)  # a place in the body's frame is none, and so no setpoint
    bench.run(2.0)
    assert abs(bench.copter.airframe.x) < 0.3 and bench.firmware.mode != 6 << 16


def test_a_px4_takes_off_to_a_place(hand):
    bench = Bench("px4").run(2.5)
    bench.setpoint = local((0.0, 0.0, -1.2))
    bench.run(1.5)
    assert bench.command(176, 1.0, 6.0) == 0 and bench.command(400, 1.0) == 0
    assert north_east_up(bench.run(8.0)) == (0.0, 0.0, 1.2) and "Takeoff detected" in bench.texts()


@pytest.mark.parametrize(
    ("frame", "place", "there"),
    [(1, (2.0, 1.0, -2.0), (2, 1, 2)), (7, (2.0, 1.0, -1.0), (2, 1, 2)), (9, (2.0, 1.0, 0.0), (1, -2, 1))],
)
def test_an_ardupilot_flies_to_a_place_that_is_said_once(bench_of, frame, place, there):
    bench = bench_of("ardupilot")
    if frame == 9:  # to the west, so that the right is north
        bench.setpoint = f.SetPositionTargetLocalNed(0, 5, 1, 8, 0x9C7, 0, 0, 0, 0, 0, 0, 0, 0, 0, -math.pi / 2, 0)
        bench.run(4.0)
    bench.setpoint = None
    bench.say(local(place, frame))
    bench.run(9.0)
    assert north_east_up(bench) == tuple(map(float, there)) and bench.firmware.mode == GUIDED


def test_an_ardupilot_flies_to_places_on_earth(bench_of):
    bench = bench_of("ardupilot")
    bench.setpoint = None
    bench.command(176, 1.0, LOITER)
    assert reposition(bench, 2.0, 0.0, 2.0, frame=6, flag=0.0) == 2, "not in GUIDED, and without the flag"
    assert reposition(bench, 2.0, 0.0, 2.0, frame=6) == 0 and bench.firmware.mode == GUIDED
    assert north_east_up(bench.run(7.0)) == (2.0, 0.0, 2.0)
    assert reposition(bench, 2.0, 0.0, 2.0, frame=1) == 2 and bench.command(192, -1.0, 1.0) == 3
    # DroneKit's simple_goto, to all systems.
    latitude, longitude = on_earth(0.0, 2.0)
    item = f.MissionItem(0, 0, 0, 3, 16, 2, 0, 0.0, 0.0, 0.0, 0.0, latitude * 1e-7, longitude * 1e-7, 1.0, 0)
    answers = bench.say(item)
    assert [one.type for one in answers if isinstance(one, s.MissionAck)] == [0]
    assert north_east_up(bench.run(8.0)) == (0.0, 2.0, 1.0)
    latitude, longitude = on_earth(0.0, -2.0)
    bench.say(f.SetPositionTargetGlobalInt(0, 5, 1, 6, PLACE, latitude, longitude, 1.0, 0, 0, 0, 0, 0, 0, 0, 0))
    bench.run(1.5)
    assert bench.copter.airframe.vy > 0.5
    assert bench.command(176, 1.0, LOITER) == 0
    bench.run(8.0)
    assert abs(bench.copter.airframe.vy) < 0.1 and bench.copter.airframe.y < 1.5
    assert [one.type for one in bench.say(item) if isinstance(one, s.MissionAck)] == [1], "in GUIDED only"


def test_an_ardupilot_turns_to_a_heading_and_takes_a_speed(bench_of):
    """DroneKit's condition_yaw and groundspeed."""
    bench = bench_of("ardupilot")
    bench.setpoint = None
    assert bench.command(115, 90.0, 0.0, 1.0, 0.0) == 0
    assert bench.run(5.0).copter.airframe.yaw == pytest.approx(-math.pi / 2, abs=0.1)
    assert bench.command(115, 30.0, 0.0, -1.0, 1.0) == 0
    assert bench.run(4.0).copter.airframe.yaw == pytest.approx(math.radians(-60.0), abs=0.15)
    assert bench.command(115, 400.0) == bench.command(115, 0.0, 0.0, 1.0, 0.5) == 4
    assert bench.command(178, 1.0, 0.0) == bench.command(178, 4.0, 1.0) == 2 and bench.command(178, 9.0, 1.0) == 4
    assert bench.command(178, 1.0, 0.5) == 0
    bench.say(local((9.0, 0.0, -1.0)))
    assert bench.run(4.0).copter.airframe.vx == pytest.approx(0.5, abs=0.15)
    assert bench.command(176, 1.0, LOITER) == 0 and bench.command(178, 1.0, 1.0) == 4


def test_a_px4_takes_any_speed_and_turns_to_no_heading_of_an_ardupilot(bench_of):
    bench = bench_of("px4")
    assert bench.command(178, 1.0, 0.5) == 0 and bench.copter.fastest_m_s == 0.5
    assert bench.command(178, 1.0, -1.0) == 0 and bench.copter.fastest_m_s == 2.0
    assert bench.command(115, 90.0, 0.0, 1.0) == 3


def test_places_that_are_no_numbers_move_nothing(bench_of):
    bench = bench_of("ardupilot")
    bench.setpoint = None
    before = north_east_up(bench)
    for place in ((NAN, 8.5, 1.0), (47.4, math.inf, 1.0), (47.4, 8.5, NAN)):
        answers = bench.say(f.MissionItem(0, 0, 0, 3, 16, 2, 0, 0.0, 0.0, 0.0, 0.0, *place, 0))
        assert [one.type for one in answers if isinstance(one, s.MissionAck)] == [1]
    latitude, longitude = on_earth(3.0, 0.0)
    bench.say(f.SetPositionTargetGlobalInt(0, 5, 1, 6, PLACE, latitude, longitude, NAN, 0, 0, 0, 0, 0, 0, 0, 0))
    bench.say(local((NAN, 1.0, -1.0)))
    assert before == north_east_up(bench.run(3.0)).expected


def test_without_a_place_of_its_own_an_ardupilot_goes_nowhere(hand):
    bench = Bench("ardupilot").up()
    assert reposition(bench, 2.0, 0.0, 2.0, frame=6) in (2, 4)
