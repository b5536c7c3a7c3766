"""A pilot with a transmitter overrules the driver about landing; without one, the driver decides."""

import pytest

from drivers.mavlink.wire.flight import CommandLong
from drivers.mavlink.wire.names import FORCE, CopterMode, Flavour, MavCmd, MavResult, Px4Main, px4_mode
from drivers.mavlink.wire.telemetry import LocalPositionNed
from groundstation.bus.messages import Verb

_STICKS = {Flavour.PX4: px4_mode(Px4Main.ALTITUDE), Flavour.ARDUPILOT: CopterMode.ALT_HOLD}
_PLACES = {Flavour.PX4: px4_mode(Px4Main.POSITION), Flavour.ARDUPILOT: CopterMode.POSHOLD}


def landings(rig) -> int:
    return sum(m.command == MavCmd.NAV_LAND for _, m in rig.sent(CommandLong))


@pytest.fixture(autouse=True)
def told_when_lost(rig):
    """As `groundstation mavlink setup` writes it where a transmitter is received."""
    rig.emulator.firmware.parameters.values["FS_THR_ENABLE"] = 3


def take_over(rig, mode):
    rig.track_on()
    rig.emulator.firmware.transmitter = True
    rig.run(1.0)  # its health is sent twice a second
    rig.emulator.firmware.enter(mode)
    rig.run(2.0)
    rig.link.sent.clear()


def lose_positions(rig):
    rig.sees = False
    rig.until(lambda: rig.mode == "LANDING", 6.0)
    rig.run(2.5)


def test_a_vehicle_flown_by_sticks_is_not_landed_by_a_failsafe(rig):
    take_over(rig, _STICKS[rig.flavour])
    lose_positions(rig)
    assert not landings(rig)
    assert sum("its pilot lands it" in text for text in rig.texts) == 1


def test_it_is_landed_once_the_pilot_gives_it_back(rig):
    take_over(rig, _STICKS[rig.flavour])
    lose_positions(rig)
    rig.emulator.firmware.enter(rig.emulator.firmware.guided)
    rig.run(1.5)
    assert landings(rig) and rig.emulator.firmware.mode == rig.emulator.firmware.landing


def test_it_is_landed_once_the_transmitter_is_silent(rig):
    take_over(rig, _STICKS[rig.flavour])
    lose_positions(rig)
    rig.emulator.firmware.transmitter = False
    rig.run(1.5)
    assert landings(rig)


def test_a_vehicle_whose_lost_transmitter_nothing_tells_has_no_pilot(rig_of):
    """A real ArduCopter climbed at 4.7 m/s without end: its receiver counts as healthy with FS_THR_ENABLE 0."""
    rig = rig_of("ardupilot")
    firmware = rig.emulator.firmware
    firmware.parameters.values["FS_THR_ENABLE"] = 0
    take_over(rig, CopterMode.ALT_HOLD)
    firmware.transmitter = False
    for turn in range(400):
        if firmware.mode == CopterMode.ALT_HOLD:
            rig.copter.fly((0.0, 0.0, min(4.0, 0.02 * turn)), 0.0)
        rig.run(0.01)
    assert rig.mode == "LANDING" and landings(rig) and firmware.mode == firmware.landing
    assert "it climbs" in rig.host.watchdog.reason and "0.4 are allowed, not by our orders" in rig.host.watchdog.reason
    assert sum("FS_THR_ENABLE is 0, needs 3" in text for text in rig.texts) == 1


def test_an_ardupilot_that_tells_the_loss_lands_by_itself(rig_of):
    rig = rig_of("ardupilot")
    rig.emulator.firmware.parameters.values["FS_THR_ENABLE"] = 3
    take_over(rig, CopterMode.ALT_HOLD)
    rig.emulator.firmware.transmitter = False
    rig.until(lambda: rig.mode == "LANDING", 2.0)
    assert "lands by itself" in rig.host.watchdog.reason


def test_it_is_landed_in_a_mode_that_needs_a_position(rig):
    take_over(rig, _PLACES[rig.flavour])
    lose_positions(rig)
    assert landings(rig)


@pytest.mark.parametrize("heard", [True, False])
def test_a_pilots_takeover_of_a_landing_needs_a_transmitter(rig, heard):
    rig.track_on()
    firmware = rig.emulator.firmware
    firmware.transmitter = heard
    rig.run(1.0)
    rig.order(Verb.LAND)
    rig.until(lambda: firmware.mode == firmware.landing, 2.0)
    rig.link.sent.clear()
    firmware.enter(_STICKS[rig.flavour])
    rig.run(2.0)
    assert bool(landings(rig)) is not heard


def test_an_operators_landing_is_sent_to_a_pilot_too(rig):
    take_over(rig, _STICKS[rig.flavour])
    lose_positions(rig)
    rig.order(Verb.LAND)
    rig.run(1.0)
    assert landings(rig)


def test_a_vehicle_without_velocity_is_not_reported_as_silent(rig):
    """A real ArduCopter stops sending LOCAL_POSITION_NED in flight once its estimator has no position."""
    rig.track_on()
    rig.emulator.speaker.builders[LocalPositionNed] = lambda: None
    rig.run(2.0)
    view = rig.host.watchdog.vehicle
    assert not view.fresh and view.silence == "it tells no velocity, as its own estimator knows none"
    (told,) = [text for text in rig.process.texts if "trying on" in text]
    assert "does not answer" not in told and view.silence in told


def test_motors_that_somebody_stops_in_flight_are_told_as_that(rig):
    rig.track_on()
    rig.run(1.0)
    rig.emulator.firmware.disarm(FORCE)
    rig.run(2.0)
    assert sum("its motors were stopped" in text and "not by us" in text for text in rig.texts) == 1
    rig.until(lambda: rig.mode == "LANDED", 8.0)
    rig.run(0.1)
    assert rig.host.watchdog.reason == "its motors were stopped in flight, not by us: it fell"
    rig.order(Verb.TAKEOFF)
    rig.run(0.2)
    rig.order(Verb.LAND)
    rig.until(lambda: rig.mode == "LANDED", 10.0)
    rig.run(0.2)
    assert "fell" not in rig.host.watchdog.reason, "of this start nothing fell"
    rig.order(Verb.TAKEOFF)
    rig.until(lambda: rig.mode == "HOVER", 12.0)
    rig.order(Verb.LAND)
    rig.until(lambda: rig.mode == "LANDED", 10.0)
    assert rig.host.watchdog.reason == "landed (landing for op)"


def test_motors_that_stop_after_a_landing_are_not(rig):
    rig.track_on()
    rig.order(Verb.LAND)
    rig.until(lambda: rig.mode == "LANDED", 10.0)
    assert not any("its motors were stopped" in text for text in rig.texts)
    rig.run(2.0)
    assert rig.host.watchdog.reason == "landed (landing for op)"


def test_motors_that_our_cut_stops_are_not(rig):
    rig.track_on()
    rig.run(1.0)
    rig.order(Verb.CUT_MOTORS)
    rig.run(4.0)
    assert not any("its motors were stopped" in text for text in rig.texts)
    assert rig.host.watchdog.reason == "motors cut by op"


@pytest.mark.parametrize(
    "words", ["Preflight Fail: ekf2 missing data", "Arming denied: Resolve system health failures"]
)
def test_a_take_off_that_the_vehicle_refuses_ends_with_its_words(rig, words):
    rig.connect()
    firmware = rig.emulator.firmware
    firmware.arming_fault = lambda: words
    rig.order(Verb.TAKEOFF)
    rig.run(3.0)
    firmware.say(2, "Arming denied: Resolve system health failures")
    rig.until(lambda: rig.mode == "LANDED", 12.0)
    assert rig.host.watchdog.reason == f"landed (take-off took too long: {words})"


def test_a_refusal_of_an_earlier_take_off_is_none_of_this_one(rig):
    rig.connect()
    rig.emulator.firmware.say(2, "Preflight Fail: ekf2 missing data")
    rig.run(1.0)
    rig.emulator.firmware.take_off = lambda height_m: (MavResult.DENIED, "")
    rig.copter.fly = lambda *asked: None
    rig.order(Verb.TAKEOFF)
    rig.until(lambda: rig.mode in ("LANDING", "LANDED") and rig.host.watchdog.failsafe, 14.0)
    assert "take-off took too long" in rig.host.watchdog.reason and "Preflight" not in rig.host.watchdog.reason
