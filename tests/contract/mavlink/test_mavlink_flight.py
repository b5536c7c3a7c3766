"""The driver flies the emulated PX4 and ArduPilot: take-off, velocity, loss of any sender, landing."""

import itertools
import math

import pytest
from mavlink_bench import GROUND

from drivers.host import VehicleHost, sleep_serving
from drivers.mavlink.vehicle import MavlinkVehicle
from drivers.mavlink.wire.flight import CommandLong, OdometryMessage, SetPositionTargetLocalNed
from drivers.mavlink.wire.names import CopterMode, Flavour, Px4Auto, Px4Main, px4_mode
from drivers.mavlink.wire.service import ParamRequestRead, SetGpsGlobalOrigin, Timesync
from drivers.mavlink.wire.telemetry import Attitude, EstimatorStatus, GpsGlobalOrigin, Heartbeat, LocalPositionNed
from groundstation.bus.messages import Verb
from groundstation.bus.topics import COMMAND_ACK, IMU, ODOMETRY, VEHICLE_STATUS

S = 1_000_000_000


def test_it_is_discovered_and_configured_within_two_seconds(rig):
    rig.until(lambda: rig.host.watchdog.mode == "LANDED", 2.0)
    rig.until(lambda: not rig.host.watchdog.vehicle.not_ready, 6.0)


def test_it_takes_off_hovers_flies_and_lands(rig):
    rig.track_on()
    assert 0.65 < rig.body.z < 1.1
    rig.wanted = ((0.4, 0.0, 0.0), 0.0)
    rig.run(1.5)
    forward, left, up = rig.mean_velocity(4.0)
    # PX4 stays 15 % below its setpoint, which must cause no windup.
    assert 0.27 < forward < 0.45 and abs(left) < 0.1 and abs(up) < 0.1
    rig.wanted = ((0.0, 0.3, 0.0), 0.5)
    rig.run(3.0)
    forward, left, up = rig.velocity()
    assert 0.15 < left < 0.4 and abs(forward) < 0.25
    assert rig.body.yaw_rate == pytest.approx(0.5, abs=0.08)
    rig.wanted = ((0.0, 0.0, 0.2), 0.0)
    rig.run(2.0)
    assert rig.velocity()[2] == pytest.approx(0.2, abs=0.08)
    rig.order(Verb.LAND)
    rig.until(lambda: rig.mode == "LANDED")
    rig.until(lambda: not rig.emulator.firmware.armed, 5.0)
    stages = [(a.verb, a.stage) for a in rig.messages(COMMAND_ACK)]
    assert (Verb.TAKEOFF, "EFFECTIVE") in stages and (Verb.LAND, "EFFECTIVE") in stages


def test_published_telemetry_is_measured_and_never_our_own_position(rig):
    rig.track_on()
    rig.wanted = ((0.3, -0.2, 0.0), 0.3)
    for topic in (ODOMETRY, IMU, VEHICLE_STATUS):
        rig.messages(topic)
    yaw = rig.body.yaw
    rig.run(4.0)
    odometry, imu, status = (rig.messages(t) for t in (ODOMETRY, IMU, VEHICLE_STATUS))
    assert 190 <= len(odometry) <= 210 and 95 <= len(imu) <= 105
    assert all(o.position_m is None and o.height_m is None for o in odometry)
    assert odometry[-1].velocity_covariance[0] >= 0.1**2
    assert odometry[-1].velocity_m_s[:2] == pytest.approx(rig.velocity()[:2], abs=0.12)
    turned = math.remainder(odometry[-1].yaw_rad - odometry[0].yaw_rad, math.tau)
    assert turned == pytest.approx(math.remainder(rig.body.yaw - yaw, math.tau), abs=0.05)
    assert imu[-1].specific_force_m_s2[2] == pytest.approx(9.8, abs=0.8)
    assert imu[-1].angular_velocity_rad_s[2] == pytest.approx(0.3, abs=0.1)
    assert status[-1].battery > 0.5 and status[-1].link_quality == 1.0 and status[-1].mode == "TRACK"


def test_each_setpoint_goes_out_once_at_most_at_its_rate(rig):
    rig.track_on()
    rig.wanted = ((0.2, 0.0, 0.0), 0.0)
    rig.run(0.5)
    rig.link.sent.clear()
    rig.run(2.0)
    times = [at for at, _ in rig.sent(SetPositionTargetLocalNed)]
    assert 36 <= len(times) <= 52
    assert all(m.type_mask == 0x5C7 and m.coordinate_frame == 8 for _, m in rig.sent(SetPositionTargetLocalNed))
    assert max(b - a for a, b in itertools.pairwise(times)) <= 70_000_000
    rig.tracking = False
    rig.link.sent.clear()
    rig.run(0.25)
    # No new setpoint from the tracker: none is repeated; after 0.3 s the watchdog hovers.
    assert len(rig.sent(SetPositionTargetLocalNed)) <= 1
    rig.run(0.3)
    # To stand still: the setpoint then is its last known velocity error and shortfall.
    added = rig.vehicle.orders.drift.correction(rig.hand.now)
    assert rig.sent(SetPositionTargetLocalNed)[-1][1].vx == pytest.approx(added[0], abs=0.01)


def test_a_setpoint_goes_out_when_it_comes_and_not_at_the_next_turn(rig):
    rig.track_on()
    rig.run(0.1)
    woken, came_ns, next_turn_ns = [], rig.hand.now + 52_000_000, rig.hand.now + 10 * S
    rig.host.call_on_setpoints(lambda: woken.append(rig.hand.now))

    def sleep_until(deadline_ns):
        rig.hand.now = came_ns if not woken else deadline_ns
        if not woken:
            rig.track(came_ns)
        return True

    rig.process.sleep_until = sleep_until
    rig.link.sent.clear()
    sleep_serving(rig.process, [rig.host], next_turn_ns)
    assert [ns for ns, m in rig.link.sent if isinstance(m, SetPositionTargetLocalNed)] == [came_ns]
    assert woken == [came_ns] and rig.hand.now == next_turn_ns


def test_px4_is_asked_to_stop_the_streams_that_nobody_uses(rig_of):
    rig = rig_of("px4").connect().run(0.5)
    assert Attitude not in rig.emulator.channel(GROUND).rates.intervals
    assert rig.emulator.channel(GROUND).rates.intervals[OdometryMessage] == 40  # 5 Hz, for its covariances
    assert rig.emulator.channel(GROUND).rates.intervals[LocalPositionNed] == 4
    assert rig.emulator.channel(GROUND).rates.intervals[EstimatorStatus] == 40  # its doubts are 3 s old at most


def test_setpoints_are_clamped(rig):
    rig.track_on()
    rig.wanted = ((9.0, 9.0, 9.0), 9.0)
    rig.link.sent.clear()
    rig.run(0.2)
    sent = rig.sent(SetPositionTargetLocalNed)[-1][1]
    added = rig.vehicle.orders.drift.correction(rig.hand.now)  # the limits are of the true velocity
    assert math.hypot(sent.vx - added[0], sent.vy + added[1]) == pytest.approx(0.6, abs=0.02)
    assert (
        math.hypot(*rig.vehicle.orders.drift.drift(rig.hand.now)) < 0.15
        and sent.vz == pytest.approx(-0.4 - added[2], abs=0.02)
        and sent.yaw_rate == pytest.approx(-math.radians(60))
    )


def test_silent_tracker_hovers_then_lands(rig):
    rig.track_on()
    rig.wanted = ((0.5, 0.0, 0.0), 0.0)
    rig.run(2.0)
    rig.tracking = False
    rig.run(1.8)
    assert math.hypot(*rig.velocity()[:2]) < 0.2
    rig.until(lambda: rig.mode == "LANDED", 15.0)


def test_unseen_vehicle_hovers_then_lands_before_the_autopilot_would(rig):
    rig.track_on()
    rig.wanted = ((0.4, 0.0, 0.0), 0.0)
    rig.run(2.0)
    rig.sees = False
    began = rig.hand.now
    rig.until(lambda: rig.emulator.firmware.mode == rig.emulator.firmware.landing, 9.0)
    # About 3.2 s until max_std_m, land_after_s 0.7
    assert 3.5 < (rig.hand.now - began) / 1e9 < 4.5
    assert rig.host.watchdog.reason == "no position from the cameras"
    rig.until(lambda: rig.mode == "LANDED", 15.0)


def test_belief_that_breaks_down_lands_it_within_a_second(rig):
    rig.track_on()
    rig.wanted = ((0.4, 0.0, 0.0), 0.0)
    rig.run(2.0)
    rig.noise_m = 0.6  # the covariance says so
    began = rig.hand.now
    rig.run(0.4)
    assert abs(rig.sent(SetPositionTargetLocalNed)[-1][1].vx) < 0.1
    rig.until(lambda: rig.emulator.firmware.mode == rig.emulator.firmware.landing, 3.0)
    assert 0.6 < (rig.hand.now - began) / 1e9 < 1.0
    rig.until(lambda: rig.mode == "LANDED", 15.0)


def test_killed_driver_is_survived_by_the_vehicles_own_time_out(rig):
    rig.track_on()
    rig.wanted = ((0.5, 0.0, 0.0), 0.0)
    rig.run(1.5)
    assert rig.mean_velocity(1.5)[0] > 0.35
    rig.driving = False
    rig.run(3.5)
    assert math.hypot(*rig.velocity()[:2]) < 0.25
    rig.until(lambda: not rig.emulator.firmware.armed, 25.0)


def test_restarted_driver_lands_what_flies(rig, rig_of, flavour):
    rig.track_on()
    rig.run(0.5)
    before = rig.host
    rig.vehicle = MavlinkVehicle(rig.settings, rig.settings.vehicles[0], rig.link, rig.process.bus)
    rig.host = VehicleHost(rig.process, rig.vehicle, before.watchdog.limits)
    rig.link.sent.clear()
    rig.until(lambda: rig.mode == "LANDING", 2.0)
    rig.until(lambda: rig.mode == "LANDED", 15.0)
    assert not [m for _, m in rig.sent(CommandLong) if m.command in (22,)]


def test_cut_motors_falls(rig):
    rig.track_on()
    rig.order(Verb.CUT_MOTORS)
    rig.run(0.2)
    assert not rig.emulator.firmware.armed
    rig.until(lambda: rig.body.on_ground, 2.0)


def test_refused_arming_is_explained(rig_of, flavour):
    rig = rig_of(flavour)
    rig.connect()
    rig.copter.battery = 0.10
    rig.host.watchdog.limits = rig.host.watchdog.limits.__class__(battery_min=0.0)
    rig.order(Verb.TAKEOFF)
    rig.run(4.0)
    assert rig.mode != "HOVER"
    assert any("battery low" in text.lower() for text in rig.texts) or "arm" in rig.host.watchdog.vehicle.not_ready


def test_wrong_parameters_forbid_the_take_off(rig_of, flavour):
    rig = rig_of(flavour, configured=False)
    rig.run(5.0)
    assert "groundstation mavlink setup --apply" in rig.host.watchdog.vehicle.not_ready
    rig.order(Verb.TAKEOFF)
    rig.run(1.0)
    assert rig.mode == "LANDED" and not rig.emulator.firmware.armed
    assert [a.reason for a in rig.messages(COMMAND_ACK) if a.stage == "REFUSED"]


def test_pilots_mode_change_is_not_fought(rig):
    rig.track_on()
    rig.run(1.0)
    rig.emulator.firmware.enter(3 << 16 if rig.flavour == 12 else 16)  # POSCTL, POSHOLD
    rig.link.sent.clear()
    rig.run(3.0)
    assert not [m for _, m in rig.sent(CommandLong) if m.command == 176]
    assert any("not ours to fly until RESUME" in text for text in rig.texts)
    rig.order(Verb.HOLD)
    rig.run(0.1)
    rig.order(Verb.RESUME)
    rig.run(1.5)  # a PX4 needs a second of setpoints first
    assert rig.emulator.firmware.mode == rig.emulator.firmware.guided


@pytest.mark.parametrize("verb", [Verb.RESUME, Verb.TRACK])
def test_a_pilots_takeover_ends_by_command_not_by_new_setpoints(rig, verb):
    """The tracker pauses for less than the time that requires RESUME; that does not take the vehicle from a pilot."""
    rig.track_on()
    firmware = rig.emulator.firmware
    firmware.enter(px4_mode(Px4Main.AUTO, Px4Auto.HOLD) if rig.flavour == Flavour.PX4 else CopterMode.BRAKE)
    rig.run(3.0)
    rig.tracking = False
    rig.until(lambda: rig.host.watchdog.braked, 1.0)
    rig.tracking = True
    rig.run(3.0)
    assert rig.mode == "TRACK" and firmware.mode != firmware.guided
    rig.order(verb)
    rig.run(5.0)
    assert firmware.mode == firmware.guided and rig.mode == "TRACK"
    assert not any("temporarily rejected" in text for text in rig.texts)


def test_a_driver_that_comes_later_finds_the_origin_that_is_set(rig):
    """ArduPilot neither changes nor repeats an origin that it has."""
    rig.connect()
    rig.vehicle = MavlinkVehicle(rig.settings, rig.settings.vehicles[0], rig.link, rig.process.bus)
    rig.host = VehicleHost(rig.process, rig.vehicle, rig.host.watchdog.limits)
    rig.connect()


def test_px4_that_says_nothing_of_its_origin_still_flies(rig_of):
    rig = rig_of("px4")
    del rig.emulator.speaker.builders[GpsGlobalOrigin]
    rig.emulator.services._set_origin = lambda message: []
    rig.track_on()
    sent = [m for _, m in rig.sent(SetGpsGlobalOrigin)]
    rig.run(8.0)
    assert len(sent) <= 5 and len(rig.sent(SetGpsGlobalOrigin)) <= 5


@pytest.mark.parametrize("jump_s", [3600, -4])
def test_a_vehicles_clock_that_jumps_is_named_and_moves_nothing(rig, jump_s):
    rig.track_on()
    rig.wanted = ((0.3, 0.0, 0.0), 0.0)
    rig.run(2.0)
    rig.messages(ODOMETRY)
    tell = rig.emulator.speaker.local_position
    rig.emulator.speaker.builders[LocalPositionNed] = lambda: (
        (m := tell()) and m._replace(time_boot_ms=m.time_boot_ms + jump_s * 1000)
    )
    assert 0.1 < rig.mean_velocity(2.0)[0] < 0.4 and rig.mode == "TRACK"
    stamps = [o.header.stamp_ns for o in rig.messages(ODOMETRY)]
    assert len(stamps) > 90 and all(0 < b - a < 50_000_000 for a, b in itertools.pairwise(stamps))
    assert rig.vehicle.health(rig.hand.now).rejected["clock_jump"] == 1
    assert any(f"its clock jumped by {jump_s} s" in text for text in rig.texts)
    rig.order(Verb.LAND)
    rig.until(lambda: rig.mode == "LANDED")


def test_a_standing_vehicle_that_restarts_within_a_moment_is_asked_for_everything_anew(rig):
    """Its heartbeats hardly pause, but streams, origin and parameters are lost."""
    rig.connect()
    rig.run(8.0)
    before = len(rig.sent(ParamRequestRead))
    speaker, tell, began = rig.emulator.speaker, rig.emulator.speaker.local_position, rig.hand.now
    rig.emulator.channel(GROUND).rates.intervals = {Heartbeat: 200}
    speaker.builders[LocalPositionNed] = lambda: (
        (m := tell()) and m._replace(time_boot_ms=(rig.hand.now - began) // 1_000_000)
    )
    rig.run(1.0)
    assert not rig.vehicle.view(rig.hand.now).fresh or rig.vehicle.view(rig.hand.now).not_ready
    rig.until(lambda: len(rig.sent(ParamRequestRead)) > before and not rig.vehicle.view(rig.hand.now).not_ready, 20.0)


def test_a_px4_that_no_longer_asks_for_our_time_is_told(rig):
    rig.connect()
    asks = {"px4": True, "ardupilot": None}[rig.vehicle.flavour.name.lower()]
    assert rig.vehicle.health(rig.hand.now).asks_time is asks
    later = rig.hand.now + 4_000_000_000
    assert rig.vehicle.health(later).asks_time is (None if asks is None else False)


def test_clock_requests_with_any_time_are_answered_with_ours(rig):
    rig.connect()
    for asked in (0, -1, 2**62, 5):
        rig.link.sent.clear()
        rig.vehicle._take(rig.hand.now, Timesync(0, asked))
        assert rig.sent(Timesync)[-1][1] == Timesync(rig.hand.now, asked)
