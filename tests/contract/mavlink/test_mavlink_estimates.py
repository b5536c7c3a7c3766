"""The emulated autopilots' reports of their own estimates, and their errors without cameras."""

import math

import pytest
from mavlink_bench import Bench

from drivers.mavlink.wire import telemetry as t
from drivers.mavlink.wire.names import Flavour
from groundstation.bus.messages import Verb


@pytest.fixture
def bench_of(hand):
    return Bench


def test_test_ratios_are_those_of_its_own_estimate(bench_of, flavour):
    """PX4 sends them unasked, once a second; ArduPilot on request. NaN: PX4 is fed no positions, or no velocities."""
    bench = bench_of(flavour)
    px4 = flavour == "px4"
    if not px4:
        assert bench.command(511, 193.0, 1_000_000.0) == 0
    bench.run(4.0)

    def ratios():
        stated = [m.pos_horiz_ratio for m in bench.heard if isinstance(m, t.EstimatorStatus)]
        return stated or [m.pos_horiz_variance for m in bench.heard if isinstance(m, t.EkfStatusReport)]

    assert len(ratios()) == pytest.approx(4, abs=1) and ratios()[-1] == pytest.approx(0.0, abs=0.02)
    bench.seen = False
    bench.run(1.0)
    assert math.isnan(ratios()[-1]) == px4
    body = bench.copter.airframe
    assert not bench.copter.estimate.aid((body.x + 0.9, body.y, body.z), body.yaw, 0)
    bench.run(0.2)
    assert bench.command(512, 230.0 if px4 else 193.0) == 0
    assert ratios()[-1] == pytest.approx(1.5, abs=0.05)
    assert not px4 or math.isnan([m for m in bench.heard if isinstance(m, t.EstimatorStatus)][-1].vel_ratio)


@pytest.mark.parametrize(("patience_us", "valid_s"), [(900_000, 0.4), (5_000_000, 4.4)])
def test_the_flags_of_a_px4_are_taken_back_after_the_last_position(bench_of, patience_us, valid_s):
    bench = bench_of("px4")
    bench.firmware.parameters.values["EKF2_NOAID_TOUT"] = patience_us

    def flags():
        assert bench.command(512, 230.0) == 0
        return [m for m in bench.heard if isinstance(m, t.EstimatorStatus)][-1].flags

    bench.seen = False
    bench.run(1.0)
    assert flags() == 0xA5
    bench.seen = True
    bench.run(1.0)
    assert flags() == 0x1AF
    bench.seen = False
    bench.run(valid_s - 0.1)
    assert flags() == (0x1AF if valid_s < 0.5 else 0x0AF)
    bench.run(0.2)
    assert flags() == 0xA5


class Leaning:
    """A level error [rad]."""

    def __init__(self, degrees):
        self._error = math.radians(degrees)

    def step(self):
        return self._error


def test_a_landing_without_cameras_goes_metres_astray_where_its_level_is_off_by_two_degrees(bench_of, flavour):
    bench = bench_of(flavour).up()
    bench.fly(down=-0.5)
    bench.run(2.0)
    bench.copter.estimate._tilt = (Leaning(0.0), Leaning(2.0))
    bench.seen, bench.setpoint = False, None
    body = bench.copter.airframe
    x, y = body.x, body.y
    assert bench.command(21) == 0
    bench.run(10.0)
    assert body.on_ground
    assert 2.0 < math.hypot(body.x - x, body.y - y) < 6.0


def test_a_px4_is_doubted_when_its_positions_end_and_not_before(rig_of):
    rig = rig_of("px4").track_on().run(4.0)
    stated = rig.vehicle._publisher.stated
    assert stated.velocity_std_m_s(rig.hand.now) < 0.1
    rig.tracking = False
    rig.until(lambda: rig.copter.estimate.aided_s > 1.3)
    assert not rig.body.on_ground and stated.velocity_std_m_s(rig.hand.now) == 0.5


def test_a_vehicle_whose_estimator_takes_no_positions_is_not_ready(rig_of, flavour):
    """WIRE: PX4 sends LOCAL_POSITION_NED with or without a position; ArduPilot only with one."""
    rig = rig_of(flavour)
    feed = rig.emulator.services._vision
    rig.emulator.services._vision = lambda message, now_ns, clock: None
    rig.run(10.0)
    assert rig.vehicle.telemetry.tells_motion(rig.hand.now) == (flavour == "px4")
    assert "no position yet" in rig.host.watchdog.vehicle.not_ready
    rig.order(Verb.TAKEOFF)
    rig.run(1.0)
    assert not rig.emulator.firmware.armed and not [text for text in rig.texts if "enied" in text]
    rig.emulator.services._vision = feed
    rig.take_off()


def test_a_px4_gets_time_to_settle_from_its_first_position_on(rig_of):
    rig = rig_of("px4")
    rig.emulator.speaker.builders[t.Heartbeat] = lambda: t.Heartbeat(2, Flavour.PX4, 1, rig.emulator.firmware.mode, 0)
    feed = rig.emulator.services._vision
    rig.emulator.services._vision = lambda message, now_ns, clock: None
    rig.run(10.0)
    rig.emulator.services._vision = feed
    rig.run(3.5)
    assert rig.host.watchdog.vehicle.not_ready == "its own checks have not passed yet"
    rig.run(2.0)
    assert not rig.host.watchdog.vehicle.not_ready


def test_a_px4_that_never_sends_its_estimators_status_is_ready_as_it_says_where_it_is(rig_of):
    rig = rig_of("px4")
    rig.emulator.speaker.builders[t.EstimatorStatus] = lambda: None
    rig.connect()
