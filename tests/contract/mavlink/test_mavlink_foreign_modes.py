"""A vehicle in a mode that is not ours: a return is landed, its speed stays limited; a pilot's sticks stay free."""

import re

import pytest

from drivers.mavlink.failsafe import heartbeat, hover_and_land
from drivers.mavlink.wire.flight import VisionPositionEstimate, command_to
from drivers.mavlink.wire.frames import FrameEncoder, id_of
from drivers.mavlink.wire.names import CopterMode, Flavour, MavCmd, Px4Auto, Px4Main, px4_mode
from drivers.mavlink.wire.telemetry import AttitudeQuaternion, Heartbeat, LocalPositionNed
from groundstation.bus.messages import Verb

GROUND = ("127.0.0.1", 14999)
_RETURNS = [
    ("px4", px4_mode(Px4Main.AUTO, Px4Auto.RETURN)),
    ("px4", px4_mode(Px4Main.AUTO, Px4Auto.TAKE_OFF)),
    ("px4", px4_mode(Px4Main.AUTO, Px4Auto.PRECISION_LAND)),
    ("ardupilot", CopterMode.RTL),
    ("ardupilot", CopterMode.SMART_RTL),
    ("ardupilot", CopterMode.AUTO_RTL),
]


@pytest.mark.parametrize(("flavour", "mode"), _RETURNS)
def test_a_return_or_a_climb_of_its_own_is_landed_at_once(rig_of, flavour, mode):
    rig = rig_of(flavour)
    rig.track_on()
    rig.emulator.firmware.enter(mode)
    rig.until(lambda: rig.mode == "LANDING", 1.2)
    assert re.search("(flies home|climbs) by itself, in ", rig.host.watchdog.reason)
    rig.until(lambda: rig.emulator.firmware.mode == rig.emulator.firmware.landing, 0.2)
    rig.order(Verb.RESUME)
    rig.until(lambda: rig.mode == "LANDED", 15.0)


_HOLDS = {Flavour.PX4: px4_mode(Px4Main.AUTO, Px4Auto.HOLD), Flavour.ARDUPILOT: CopterMode.AUTO}
_PLACES = {Flavour.PX4: px4_mode(Px4Main.POSITION), Flavour.ARDUPILOT: CopterMode.POSHOLD}


def moved_on(rig, mode, speed_m_s, transmitter=False):
    """Have others fly it in a mode for 4 s; return whether it was landed."""
    firmware = rig.emulator.firmware
    firmware.parameters.values["FS_THR_ENABLE"] = 3
    rig.track_on()
    firmware.transmitter = transmitter
    rig.run(1.0)
    firmware.enter(mode)
    rig.run(1.1)
    for _ in range(400):
        if firmware.mode == mode:
            rig.copter.fly((speed_m_s, 0.0, 0.0), 0.0)
        rig.run(0.01)
    return rig.mode == "LANDING" and firmware.mode == firmware.landing


def test_a_vehicle_that_another_station_flies_fast_is_landed(rig):
    assert moved_on(rig, _HOLDS[rig.flavour], 2.0)
    assert "0.6 are allowed" in rig.host.watchdog.reason


def test_one_that_another_station_flies_slowly_is_left_alone(rig):
    assert not moved_on(rig, _HOLDS[rig.flavour], 0.5)
    assert rig.mode == "TRACK"


@pytest.mark.parametrize("transmitter", [True, False])
def test_a_pilot_who_moves_it_by_sticks_may_be_fast_while_a_transmitter_is_heard(rig, transmitter):
    assert moved_on(rig, _PLACES[rig.flavour], 2.0, transmitter) is not transmitter


def test_a_pilot_may_stop_it_from_speed_by_a_mode_that_holds_its_place(rig):
    firmware = rig.emulator.firmware
    firmware.parameters.values["FS_THR_ENABLE"] = 3
    rig.track_on()
    firmware.transmitter = True
    rig.run(1.0)
    firmware.enter(_PLACES[rig.flavour])
    for _ in range(200):
        rig.copter.fly((1.5, 0.0, 0.0), 0.0)
        rig.run(0.01)
    holds = CopterMode.BRAKE if rig.flavour is Flavour.ARDUPILOT else _HOLDS[rig.flavour]
    firmware.enter(holds)
    for turn in range(200):
        rig.copter.fly((max(0.0, 1.5 - 0.025 * turn), 0.0, 0.0), 0.0)
        rig.run(0.01)
    assert rig.mode == "TRACK" and firmware.mode == holds


def test_a_return_on_the_floor_is_no_reason_to_land(rig):
    rig.connect()
    returns = CopterMode.RTL if rig.flavour is Flavour.ARDUPILOT else px4_mode(Px4Main.AUTO, Px4Auto.RETURN)
    rig.emulator.firmware.enter(returns)
    rig.run(2.0)
    assert rig.mode == "LANDED"


def test_streams_that_another_station_slowed_down_come_again_in_time(rig):
    rig.track_on()
    rig.run(3.0)
    for kind in (LocalPositionNed, AttitudeQuaternion):
        ask = command_to(11, MavCmd.SET_MESSAGE_INTERVAL, float(id_of(kind)), 500_000.0)
        rig.emulator.take(FrameEncoder(250, 190).encode(ask), GROUND)
    rig.run(1.5)
    assert rig.host.watchdog.vehicle.silence != "it tells no velocity, as its own estimator knows none"
    rig.run(3.0)
    assert rig.mode == "TRACK" and rig.host.watchdog.vehicle.fresh
    assert sum(bool(re.match("its velocity comes at [2-4] of 50 Hz: another station", text)) for text in rig.texts) == 1


def test_a_resume_ends_the_pause_of_another_station(rig_of):
    rig = rig_of("ardupilot")
    rig.wanted = ((0.3, 0.0, 0.0), 0.0)
    rig.track_on()
    rig.run(3.0)
    rig.emulator.firmware.pause(0.0)
    rig.until(lambda: "does not do what it is told" in rig.host.watchdog.reason, 9.0)
    rig.run(1.0)
    rig.order(Verb.RESUME)
    rig.run(1.5)
    assert rig.mean_velocity(2.0)[0] == pytest.approx(0.3, abs=0.1)
    assert rig.mode == "TRACK"


def test_motors_that_somebody_else_starts_are_stopped_and_told(rig):
    rig.connect()
    rig.run(4.0)
    assert not any("its motors were started" in text for text in rig.texts)
    rig.emulator.firmware.arm(True)
    rig.run(3.0)
    assert not rig.emulator.firmware.armed
    assert sum("its motors were started, not by us" in text for text in rig.texts) == 1


def test_our_own_starts_are_not_told_as_anothers(rig):
    rig.take_off()
    rig.order(Verb.LAND)
    rig.until(lambda: rig.mode == "LANDED", 15.0)
    rig.run(4.0)
    assert not any("its motors were started" in text for text in rig.texts)


@pytest.mark.parametrize("pilot", [False, True])
def test_a_deaf_and_silent_ardupilot_gets_no_heartbeats_and_so_lands_by_itself(rig_of, pilot):
    """As one whose system id was changed: it hears heartbeats, which are for all, but no order."""
    rig = rig_of("ardupilot")
    firmware, send = rig.emulator.firmware, rig.link.send
    firmware.parameters.values["FS_THR_ENABLE"] = 3
    rig.track_on()
    if pilot:
        firmware.transmitter = True
        rig.run(1.0)
        firmware.enter(CopterMode.ALT_HOLD)
        rig.run(1.5)
    rig.link.receive = lambda: rig.link.lose() or []
    heard = (Heartbeat, VisionPositionEstimate)
    rig.link.send = lambda system, message: send(system, message) if isinstance(message, heard) else None
    rig.run(8.0)
    assert rig.mode == "LANDING"
    assert (firmware.mode == firmware.landing) is not pilot


@pytest.mark.parametrize("heartbeats_s", [0.0, 3.0])
def test_an_ardupilot_that_lands_without_its_driver_pauses_unless_a_heartbeat_was_heard(rig_of, heartbeats_s):
    """As seen with ArduCopter 4.7: its ground-station failsafe holds a landing until 4 s after that began."""
    rig = rig_of("ardupilot")
    rig.track_on()
    rig.run(2.0)
    rig.link.send = lambda system, message: None
    _, land = hover_and_land([11])
    for turn in range(340):
        if turn % 10 == 0:
            rig.emulator.take((heartbeat() if turn * 0.01 < heartbeats_s else b"") + land, GROUND)
        rig.run(0.01)
    assert rig.body.on_ground is (heartbeats_s > 0.0)
