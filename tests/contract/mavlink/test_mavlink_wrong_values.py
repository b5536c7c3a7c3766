"""A vehicle that sends wrong values: its driver stops it as if it were silent, and gives the reason."""

import math
from typing import Any

import pytest

from drivers.mavlink.wire.flight import CommandLong
from drivers.mavlink.wire.names import ChargeState, Landed, MavCmd, land_mode
from drivers.mavlink.wire.telemetry import (
    AttitudeQuaternion,
    BatteryStatus,
    ExtendedSysState,
    Heartbeat,
    HighresImu,
    LocalPositionNed,
    RawImu,
    SysStatus,
)
from groundstation.bus.messages import Verb
from groundstation.bus.topics import IMU, ODOMETRY

MOVING = (LocalPositionNed, AttitudeQuaternion, HighresImu, RawImu)


class Liar:
    """Replaces messages of a vehicle on their way to the driver."""

    def __init__(self, link):
        self.change = None
        self._receive = link.receive
        self._first = {}
        link.receive = self.receive

    def receive(self):
        heard = self._receive()
        if self.change is None:
            return heard
        frames = [self.change(one.frame) for one in heard]
        return [one._replace(frame=frame) for one, frame in zip(heard, frames, strict=True) if frame is not None]

    def freeze(self, *kinds, but=()):
        def frozen(frame):
            if not isinstance(frame.message, kinds):
                return frame
            first = self._first.setdefault(type(frame.message), frame.message)
            kept = {name: getattr(frame.message, name) for name in but if hasattr(frame.message, name)}
            return frame._replace(message=first._replace(**kept))

        self.change = frozen

    def set(self, kind, **values):
        self.change = lambda frame: (
            frame._replace(message=frame.message._replace(**values)) if isinstance(frame.message, kind) else frame
        )


FAULTS = {
    "all frozen": (lambda liar: liar.freeze(*MOVING), "all values repeat"),
    "all frozen but the clock": (lambda liar: liar.freeze(*MOVING, but=("time_boot_ms",)), "all values repeat"),
    "velocity stuck at 0": (lambda liar: liar.set(LocalPositionNed, vx=0.0, vy=0.0), "stuck at 0.00 m/s"),
    "velocity stuck at 0.5": (lambda liar: liar.set(LocalPositionNed, vx=0.5), "stuck at 0.50 m/s"),
    "attitude stuck": (lambda liar: liar.freeze(AttitudeQuaternion), "attitude is stuck"),
    "far too fast": (lambda liar: liar.set(LocalPositionNed, vx=20.0), "cannot do"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_it_hovers_within_a_second_and_lands_within_3_5_s(rig, name):
    rig.track_on()
    rig.wanted = ((0.5, 0.0, 0.0), 0.2)
    rig.run(1.0)
    break_it, word = FAULTS[name]
    break_it(Liar(rig.link))
    times: dict[Any, float] = {}
    for step in range(700):
        rig.tick()
        decision = rig.host.watchdog.step(rig.hand.now, rig.host.watchdog.vehicle, rig.host.watchdog.upstream)
        times.setdefault(str(decision.action), step * 0.005)
    assert times["HOVER"] <= 1.0 and times["LAND"] <= 3.5
    assert word in rig.host.watchdog.reason
    assert any(word in text for text in rig.process.texts), "the operator reads why"
    assert not any("does not answer" in text for text in rig.process.texts)


def swapped(frame):
    message = frame.message
    if not isinstance(message, LocalPositionNed):
        return frame
    return frame._replace(message=message._replace(vx=-message.vx, vy=-message.vy))


def pushed(frame):
    message = frame.message
    if not isinstance(message, LocalPositionNed):
        return frame
    return frame._replace(message=message._replace(vx=message.vx + 0.7))


@pytest.mark.parametrize(("lie", "word"), [(swapped, "does not do what it is told"), (pushed, "m/s")])
def test_a_velocity_that_is_alive_and_wrong_stops_it_too(rig_of, lie, word):
    rig = rig_of("ardupilot").track_on()
    rig.wanted = ((0.45, 0.0, 0.0), 0.0)
    rig.run(1.0)
    Liar(rig.link).change = lie
    rig.until(lambda: rig.mode != "TRACK", 1.5)
    assert word in rig.host.watchdog.reason
    rig.until(lambda: rig.mode == "LANDING" or math.hypot(*rig.velocity()) < 0.1, 2.5)


def test_a_px4_that_says_that_it_is_not_ready_is_given_four_seconds_from_its_first_positions_on(rig_of):
    """It refuses to arm for 3 s then; without a remote control it may report that for ever."""
    rig = rig_of("px4")
    Liar(rig.link).set(Heartbeat, system_status=0)
    rig.until(lambda: rig.host.watchdog.vehicle.not_ready == "its own checks have not passed yet")
    rig.run(3.0)
    assert rig.host.watchdog.vehicle.not_ready == "its own checks have not passed yet"
    rig.run(1.5)
    assert not rig.host.watchdog.vehicle.not_ready
    ready = rig_of("px4").connect()
    ready.order(Verb.TAKEOFF)
    ready.until(lambda: ready.mode == "TAKING_OFF", 0.2)


def once(status):
    """Change the state of one heartbeat."""
    left = [status]

    def change(frame):
        if not isinstance(frame.message, Heartbeat) or not left:
            return frame
        return frame._replace(message=frame.message._replace(system_status=left.pop()))

    return change


@pytest.mark.parametrize("status", [7, 8, 9, 255])
def test_one_heartbeat_with_a_wrong_state_cuts_no_motors(rig_of, status):
    rig = rig_of("px4").track_on()
    Liar(rig.link).change = once(status)
    rig.run(2.5)
    assert rig.mode == "TRACK" and rig.emulator.firmware.armed


def test_a_px4_that_ends_its_flight_is_taken_at_its_word_within_two_seconds(rig_of):
    rig = rig_of("px4").track_on()
    Liar(rig.link).set(Heartbeat, system_status=8)
    rig.until(lambda: rig.mode == "CUT", 2.1)


def test_heartbeats_with_a_state_that_does_not_exist_are_silence(rig_of):
    rig = rig_of("px4").track_on()
    Liar(rig.link).set(Heartbeat, system_status=9)
    rig.run(3.0)
    assert rig.mode == "TRACK"
    rig.until(lambda: rig.mode == "LANDING", 6.0)
    assert rig.emulator.firmware.armed


def test_a_battery_that_is_told_no_more_is_unknown_and_lands_it(rig_of):
    rig = rig_of("px4").track_on()
    Liar(rig.link).change = lambda frame: None if isinstance(frame.message, SysStatus | BatteryStatus) else frame
    rig.run(8.0)
    assert rig.mode == "TRACK"
    rig.until(lambda: rig.mode == "LANDING", 6.0)
    assert rig.host.watchdog.reason == "its battery is unknown"


def test_a_battery_that_its_autopilot_judges_critical_lands_it_whatever_its_charge(rig):
    """An ArduPilot's charge is 100 % at power-on; its voltage failsafe shows in charge_state only."""
    rig.track_on()
    liar = Liar(rig.link)
    liar.set(BatteryStatus, charge_state=ChargeState.LOW)
    rig.run(5.0)
    assert rig.mode == "TRACK"
    assert sum("its autopilot says that its battery is low" in text for text in rig.texts) == 1
    liar.set(BatteryStatus, charge_state=ChargeState.CRITICAL)
    rig.until(lambda: rig.mode == "LANDING", 6.0)
    assert rig.host.watchdog.reason == "battery below its limit"
    assert sum("its battery is critical" in text for text in rig.texts) == 1
    rig.until(lambda: rig.body.on_ground and not rig.copter.motors_on, 10.0)


def test_a_vehicle_whose_autopilot_judges_its_battery_failed_takes_off_not(rig):
    rig.connect()
    Liar(rig.link).set(BatteryStatus, charge_state=ChargeState.FAILED)
    rig.run(3.0)
    rig.order(Verb.TAKEOFF)
    rig.run(2.0)
    assert rig.mode == "LANDED" and not rig.copter.motors_on


def test_a_vehicle_that_says_in_flight_that_it_stands_is_landed(rig):
    """Its land detector errs or repeats itself; the vehicle must not stay in hover as if it had landed."""
    rig.track_on()
    Liar(rig.link).set(ExtendedSysState, landed_state=Landed.ON_GROUND)
    rig.until(lambda: rig.mode == "LANDING", 1.0)
    assert rig.host.watchdog.reason == "the vehicle lands by itself"
    rig.until(lambda: rig.body.on_ground and not rig.copter.motors_on, 10.0)
    assert rig.until(lambda: rig.mode == "LANDED", 1.0)


@pytest.mark.parametrize("custom_mode", [0, None], ids=["in another mode", "landing already"])
def test_a_vehicle_whose_heartbeat_says_in_flight_that_it_is_disarmed_is_landed(rig, custom_mode):
    """It may be another vehicle's heartbeat with its ids; this one reports that it is in the air, and is sent LAND."""
    rig.track_on()
    mode = land_mode(rig.flavour) if custom_mode is None else custom_mode
    Liar(rig.link).set(Heartbeat, base_mode=0, custom_mode=mode)
    rig.until(lambda: rig.mode == "LANDING", 1.5)
    rig.until(lambda: MavCmd.NAV_LAND in [message.command for _, message in rig.sent(CommandLong)], 0.1)
    rig.until(lambda: rig.body.on_ground, 10.0)
    rig.until(lambda: rig.mode == "LANDED", 1.0)


def test_an_order_to_land_is_sent_whatever_the_vehicle_says(rig):
    """Even to one whose every message says that it has landed, and to one without telemetry."""
    rig.connect()
    rig.order(Verb.LAND)
    rig.run(1.0)
    assert [m.command for _, m in rig.sent(CommandLong)].count(MavCmd.NAV_LAND) == 1
    rig.order(Verb.TAKEOFF)
    rig.until(lambda: rig.mode == "HOVER")


def test_an_order_to_land_is_sent_to_a_vehicle_that_nobody_hears(rig):
    Liar(rig.link).change = lambda _frame: None
    rig.run(1.0)
    rig.order(Verb.LAND)
    rig.run(0.1)
    assert rig.mode == "CONNECTING"
    assert MavCmd.NAV_LAND in [message.command for _, message in rig.sent(CommandLong)]
    rig.run(2.5)
    told = len(rig.sent(CommandLong))
    rig.run(2.0)
    lands = [m for _, m in rig.sent(CommandLong)[told:] if m.command == MavCmd.NAV_LAND]
    assert not lands


def test_a_driver_that_is_to_exit_has_told_to_land_first(rig):
    """Even to one that reports landed a moment after the command."""
    rig.connect()
    rig.order(Verb.LAND)
    rig.process.stop_requested = True
    rig.run(0.01)
    assert rig.mode == "LANDED" and not rig.host.is_finished(rig.hand.now)
    rig.run(1.1)
    assert rig.host.is_finished(rig.hand.now)


def test_one_that_says_no_more_whether_it_flies_is_landed(rig):
    rig.track_on()
    Liar(rig.link).change = lambda frame: None if isinstance(frame.message, ExtendedSysState) else frame
    rig.run(5.0)
    assert rig.mode == "TRACK"
    rig.until(lambda: rig.mode == "LANDING", 4.5)
    assert rig.host.watchdog.reason == "the vehicle does not say what it does"
    rig.until(lambda: rig.body.on_ground, 10.0)


def test_wrong_odometry_is_not_published_but_imu_samples_are(rig):
    rig.track_on()
    Liar(rig.link).set(LocalPositionNed, vx=0.0, vy=0.0)
    rig.run(1.0)
    rig.messages(ODOMETRY), rig.messages(IMU)
    rig.run(0.5)
    assert not rig.messages(ODOMETRY) and rig.messages(IMU)


def test_a_lie_that_ends_in_time_leaves_a_hover_that_waits_for_resume(rig):
    rig.track_on()
    liar = Liar(rig.link)
    liar.freeze(*MOVING)
    rig.run(0.8)
    liar.change = None
    rig.run(2.5)
    assert rig.mode == "HOVER" and "RESUME is needed" in rig.host.watchdog.reason
    rig.order(Verb.RESUME)
    rig.until(lambda: rig.mode == "TRACK", 1.0)


@pytest.mark.slow
@pytest.mark.study
def test_healthy_flights_and_rest_on_the_floor_give_no_alarm(rig_of, flavour):
    doubts = []
    for seed in range(2):
        rig = rig_of(flavour, seed=seed)
        update = rig.vehicle._plausibility.update

        def watched(sample, state, update=update):
            report = update(sample, state)
            doubts.extend(report.findings)
            return report

        rig.vehicle._plausibility.update = watched
        rig.connect().run(2.0).track_on()
        for turn in range(4):
            rig.wanted = ((0.5 * math.cos(turn), 0.5 * math.sin(2 * turn), 0.1), 0.5)
            rig.run(1.5)
        assert rig.mode == "TRACK", rig.host.watchdog.reason
        rig.order(Verb.LAND)
        rig.until(lambda rig=rig: rig.mode == "LANDED")
        rig.run(1.0)
    assert doubts == []
