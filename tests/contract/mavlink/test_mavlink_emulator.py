"""The emulated autopilots, without the driver, against data of real ones (docs/reference/mavlink.md 1, 2, 4, 5)."""

import struct

import numpy as np
import pytest
from mavlink_bench import CALM, Bench

from drivers.mavlink.wire import flight as f
from drivers.mavlink.wire import service as s
from drivers.mavlink.wire import telemetry as t
from sim_bridge.world.mavlink_copter import Steering
from sim_bridge.world.world import TICK_S

OFFBOARD, LAND, ALTITUDE = 6 << 16, 4 << 16 | 6 << 24, 2 << 16


@pytest.fixture
def bench_of(hand):
    return Bench


@pytest.mark.parametrize(
    ("flavour", "t10", "t63", "t90", "final"),
    [("ardupilot", 0.31, 0.74, 1.32, 1.0), ("px4", 0.22, 0.675, 1.2, 0.86)],
)
def test_velocity_steps_as_measured(bench_of, flavour, t10, t63, t90, final):
    bench = bench_of(flavour).up()
    bench.fly(forward=1.0)
    speeds = []
    for _ in range(600):
        bench.run(TICK_S)
        speeds.append(bench.copter.airframe.velocity_stabilized()[0])
    reached = np.mean(speeds[-50:])
    assert reached == pytest.approx(final, abs=0.04)
    for share, seconds in ((0.1, t10), (0.632, t63), (0.9, t90)):
        assert np.argmax(np.array(speeds) >= share * reached) * TICK_S == pytest.approx(seconds, abs=0.12)
    assert max(speeds) <= 1.05 * reached


def test_signs_of_setpoints_and_telemetry(bench_of, flavour):
    bench = bench_of(flavour).up()
    bench.fly(right=0.4, turn=0.3)
    bench.run(1.5)
    body = bench.copter.airframe
    assert body.velocity_stabilized()[1] < -0.2 and body.yaw_rate < -0.2
    bench.fly(down=0.2)
    bench.run(0.8)
    assert body.vz < -0.1
    bench.fly(forward=0.5, frame=1)  # to the north: world x, whatever the heading
    bench.run(2.0)
    assert body.vx > 0.3 and abs(body.vy) < 0.1
    bench.command(511, 32.0, 20_000.0)
    bench.command(511, 31.0, 20_000.0)
    bench.run(0.2)
    local = [m for m in bench.heard if isinstance(m, t.LocalPositionNed)][-1]
    assert (local.x, -local.y, -local.z) == pytest.approx((body.x, body.y, body.z), abs=0.05)
    q = [m for m in bench.heard if isinstance(m, t.AttitudeQuaternion)][-1]
    assert 2 * np.arctan2(q.q4, q.q1) == pytest.approx(-body.yaw, abs=0.1)


def test_px4_wants_a_stream_before_it_arms(bench_of):
    bench = bench_of("px4").run(1.0)
    assert bench.command(400, 1.0) == 1
    assert bench.command(176, 1.0, 6.0) == 0
    assert bench.command(400, 1.0) == 1
    assert any("Resolve system health failures" in text for text in bench.run(0.1).texts())
    bench.fly()
    bench.run(1.3)
    assert bench.command(400, 1.0) == 0
    assert bench.command(22, *[float("nan")] * 7) == 1, "nobody has set an origin"


def test_px4_leaves_offboard_when_setpoints_stop(bench_of):
    bench = bench_of("px4", scenario=CALM).up()
    bench.firmware.parameters.values["COM_OBL_RC_ACT"] = 0
    bench.setpoint = None
    bench.run(1.3)
    assert bench.firmware.mode == OFFBOARD
    bench.run(0.25)
    assert bench.firmware.mode == 3 << 16 and "Failsafe activated" in bench.texts()


def test_px4_drifts_in_altitude_mode_without_vision(bench_of):
    bench = bench_of("px4").up()
    bench.firmware.parameters.values |= {"EKF2_NOAID_TOUT": 5_000_000, "COM_OBL_RC_ACT": 0}  # the factory's
    bench.seen = False
    bench.run(4.7)
    assert bench.firmware.mode == OFFBOARD
    bench.run(0.9)
    assert bench.firmware.mode == ALTITUDE and bench.copter.steering is Steering.LEVEL
    assert bench.command(21) == 0 and bench.firmware.mode == LAND
    bench.run(6.0)
    assert not bench.firmware.armed and "Disarmed by landing" in bench.texts()


def test_px4_as_set_up_lands_a_second_after_the_last_position(bench_of):
    bench = bench_of("px4").up()
    bench.seen = False
    bench.run(0.9)
    assert bench.firmware.mode == OFFBOARD
    bench.run(0.2)
    assert bench.firmware.mode == LAND and "Failsafe activated" in bench.texts()


def test_px4_takes_offboard_in_the_air_only_while_setpoints_come(bench_of):
    bench = bench_of("px4").up()
    bench.firmware.enter(3 << 16)
    bench.setpoint = None
    bench.run(1.1)
    assert bench.command(176, 1.0, 6.0) == 1 and bench.firmware.mode == 3 << 16
    assert "Switching to Offboard is currently not available" in bench.run(0.1).texts()
    bench.fly()
    bench.run(0.2)
    assert bench.command(176, 1.0, 6.0) == 0 and bench.firmware.mode == OFFBOARD


@pytest.mark.parametrize(("timeout_s", "late_s"), [(3.0, 3.9), (0.5, 1.5)])
def test_ardupilot_brakes_after_guid_timeout(bench_of, timeout_s, late_s):
    bench = bench_of("ardupilot").up()
    bench.firmware.parameters.values["GUID_TIMEOUT"] = timeout_s
    bench.fly(forward=0.6)
    bench.run(2.0)
    bench.setpoint = None
    bench.run(timeout_s - 0.1)
    assert bench.copter.airframe.vx > 0.5
    bench.run(late_s - timeout_s + 0.1)
    assert bench.copter.airframe.vx < 0.3 and bench.firmware.mode == 4 and bench.firmware.armed


def test_ardupilot_lands_when_the_ground_is_lost_though_setpoints_flow(bench_of):
    bench = bench_of("ardupilot").up()
    bench.beating = False
    bench.run(0.9)  # the last heartbeat is up to a second old
    assert bench.firmware.mode == 4
    bench.run(2.0)
    assert bench.firmware.mode == 9 and "GCS Failsafe" in bench.texts()
    bench.beating = True
    bench.run(1.2)
    assert "GCS Failsafe Cleared" in bench.texts() and bench.firmware.mode == 9


def test_a_landing_of_an_ardupilot_by_a_failsafe_begins_four_seconds_later(bench_of):
    bench = bench_of("ardupilot").up()
    height_m = bench.copter.airframe.z
    bench.setpoint, bench.beating = None, False
    bench.run(6.0)
    assert bench.firmware.mode == 9
    assert bench.copter.airframe.z == pytest.approx(height_m, abs=0.1)
    bench.run(3.0)
    assert bench.copter.airframe.z < height_m - 0.5


def test_ardupilot_lands_without_vision_after_eight_seconds(bench_of):
    bench = bench_of("ardupilot").up()
    bench.seen = False
    bench.run(7.8)
    assert bench.firmware.mode == 4
    bench.run(0.4)
    assert bench.firmware.mode == 9
    assert bench.texts()[-2:] == ["EKF variance", "EKF Failsafe: changed to LAND Mode"]


def test_ardupilot_refuses_odometry_and_says_so(bench_of):
    bench = bench_of("ardupilot").run(0.5)
    assert bench.command(511, 331.0, 20_000.0) == 2
    assert "No ap_message for mavlink id (331)" in bench.run(0.1).texts()


def test_ardupilot_obeys_setpoints_in_guided_only_and_stops_at_a_bad_frame(bench_of):
    bench = bench_of("ardupilot").up()
    bench.fly(forward=0.6)
    bench.run(2.0)
    bench.fly(forward=0.6, frame=12)
    bench.run(3.0)
    assert abs(bench.copter.airframe.vx) < 0.1
    bench.firmware.set_mode(5)
    bench.fly(forward=0.6)
    bench.run(2.0)
    assert abs(bench.copter.airframe.vx) < 0.15


def test_a_paused_ardupilot_stands_in_guided_until_the_mode_is_entered_anew(bench_of):
    bench = bench_of("ardupilot").up()
    bench.fly(forward=0.6)
    bench.run(2.0)
    assert bench.command(193, 0.0) == 0
    bench.run(3.0)
    assert bench.firmware.mode == 4 and abs(bench.copter.airframe.vx) < 0.1
    assert bench.command(176, 1.0, 17.0) == 0 and bench.command(176, 1.0, 4.0) == 0
    bench.run(2.0)
    assert abs(bench.copter.airframe.vx) > 0.4


def test_a_px4_that_is_sent_nowhere_holds(bench_of):
    bench, nan = bench_of("px4").run(2.0), float("nan")
    bench.say(s.SetGpsGlobalOrigin(5, 473_977_420, 85_455_940, 488_000))
    bench.up()
    assert bench.command(192, -1.0, 0.0, 0.0, nan, nan, nan, nan) == 3, "only with the flag of a change of mode"
    assert bench.firmware.mode == OFFBOARD
    assert bench.command(192, -1.0, 1.0, 0.0, nan, nan, nan, nan) == 0
    assert bench.firmware.mode == 4 << 16 | 3 << 24


def test_unknown_requests_are_answered_and_those_of_others_are_not(bench_of, flavour):
    bench = bench_of(flavour).run(0.5)
    assert bench.command(31010) == 3
    assert bench.say(f.CommandLong(77, 1, 400, 0, 1.0)) == []
    assert bench.say(s.Ping(1, 2, 0, 0))[0][:4] == (1, 2, 255, 190)
    assert bench.say(s.MissionRequestList(5, 1))[0].count == 0
    payload = struct.pack("<HBBBBBBI", 7, 1, 4, 0, 0, 0, 0, 0).ljust(251, b"\0")
    refusal = bench.say(s.FileTransferProtocol(0, 5, 1, tuple(payload)))[0].payload
    assert (refusal[0], refusal[3], refusal[5]) == (8, 129, 4)
    assert bench.say(s.Timesync(0, 123))[0].ts1 == 123
    assert any(isinstance(m, t.AutopilotVersion) for m in bench.say(f.CommandLong(5, 1, 512, 0, 148.0)))


def test_parameters_are_listed_and_written(bench_of, flavour):
    bench = bench_of(flavour, configured=False).run(0.2)
    bench.heard.clear()
    bench.say(s.ParamRequestList(5, 1))
    bench.run(0.3)
    values = [m for m in bench.heard if isinstance(m, s.ParamValue)]
    assert [m.param_index for m in values] == list(range(values[0].param_count))
    name = "EKF2_GPS_CTRL" if flavour == "px4" else "GPS1_TYPE"
    carried = struct.unpack("<f", struct.pack("<i", 0))[0]
    assert bench.say(s.ParamSet(5, 1, name, carried, 6))[0].param_id == name
    assert bench.firmware.parameters[name] == 0
    assert bench.say(s.ParamSet(5, 1, "NO_SUCH", 1.0, 6)) == []


def test_vision_without_the_right_parameters_is_not_used(bench_of, flavour):
    bench = bench_of(flavour, configured=False)
    bench.seen = False
    bench.run(0.5)
    for n in range(20):
        bench.say(f.VisionPositionEstimate(n, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, (0.0,) * 21, 0))
    assert bench.copter.estimate.poses == 0


def test_frames_of_odometry_that_are_taken(bench_of, flavour):
    bench = bench_of(flavour)
    bench.seen = False
    bench.run(0.1)

    def feed(frame, child):
        before = bench.copter.estimate.poses
        doubt = (0.1,) * 21
        bench.say(f.OdometryMessage(1, frame, child, 0, 0, 0, (1.0, 0, 0, 0), 0, 0, 0, 0, 0, 0, doubt, doubt, 0, 2, 0))
        return bench.copter.estimate.poses > before

    assert feed(20, 12)
    assert feed(1, 12) is (flavour == "px4")
    assert not feed(8, 8)


def test_a_jump_is_believed_only_with_a_new_reset_counter(bench_of, flavour):
    bench = bench_of(flavour).run(1.0)
    bench.seen = False

    def feed(north, resets):
        bench.say(f.VisionPositionEstimate(1, north, 0.0, 0.0, 0.0, 0.0, 0.0, (0.0,) * 21, resets))
        return bench.copter.estimate.position[0]

    feed(0.0, 0)
    assert abs(feed(2.0, 0)) < 0.1
    assert feed(2.0, 1) == pytest.approx(2.0)


def test_px4_follows_the_ground_stations_clock_and_bears_its_jump(bench_of):
    bench = bench_of("px4")
    bench.seen, jump = False, 0

    def run(seconds):
        used = bench.copter.estimate.poses
        for _ in range(round(seconds / 0.05)):
            bench.run(0.05)
            asked = [m for m in bench.heard if isinstance(m, s.Timesync) and m.tc1 == 0]
            now_us = bench.emulator.now_ns // 1000 + 7_000_000 + jump
            if asked:
                bench.say(s.Timesync(now_us * 1000, asked[-1].ts1))
            bench.say(f.VisionPositionEstimate(now_us, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, (0.0,) * 21, 0))
        return bench.copter.estimate.poses - used

    bench.say(t.Heartbeat(6, 8, 0, 0, 4))
    assert run(1.0) > 15
    jump = 3_000_000
    run(1.5)
    assert run(1.0) > 15


def heard_in_a_second(bench, kind):
    bench.heard.clear()
    bench.run(1.0)
    return sum(isinstance(message, kind) for message in bench.heard)


def test_an_ardupilot_sends_each_stream_by_the_last_request_and_a_px4_ignores_them(bench_of):
    bench = bench_of("ardupilot").up()
    for rate_hz in (1, 10, 2):
        bench.say(s.RequestDataStream(5, 1, 0, rate_hz, 1))
        assert heard_in_a_second(bench, t.Attitude) == heard_in_a_second(bench, t.LocalPositionNed) == rate_hz
    bench.say(s.RequestDataStream(5, 1, 10, 20, 1))
    assert (heard_in_a_second(bench, t.Attitude), heard_in_a_second(bench, t.LocalPositionNed)) == (20, 2)
    bench.say(s.RequestDataStream(5, 1, 0, 4, 0))
    assert heard_in_a_second(bench, t.Attitude) == heard_in_a_second(bench, t.SysStatus) == 0
    other = bench_of("px4").up()
    before = heard_in_a_second(other, t.Attitude)
    other.say(s.RequestDataStream(5, 1, 0, 1, 1))
    assert before > 50 and abs(heard_in_a_second(other, t.Attitude) - before) <= 1
