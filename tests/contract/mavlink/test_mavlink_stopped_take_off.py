"""A take-off stopped from elsewhere: the driver does not request it again."""

from drivers.mavlink.wire.flight import CommandLong
from drivers.mavlink.wire.names import FORCE, CopterMode, Flavour, MavCmd, Px4Auto, Px4Main, px4_mode
from drivers.mavlink.wire.telemetry import LocalPositionNed
from groundstation.bus.messages import Verb

_RESTARTS = {MavCmd.DO_SET_MODE, MavCmd.NAV_TAKEOFF}
_HOLD = {Flavour.PX4: px4_mode(Px4Main.AUTO, Px4Auto.HOLD), Flavour.ARDUPILOT: CopterMode.BRAKE}
_LAND = {Flavour.PX4: px4_mode(Px4Main.AUTO, Px4Auto.LAND), Flavour.ARDUPILOT: CopterMode.LAND}


def begin(rig):
    rig.connect()
    rig.until(lambda: not rig.host.watchdog.vehicle.not_ready, 8.0)
    rig.order(Verb.TAKEOFF)
    firmware = rig.emulator.firmware
    rig.until(lambda: firmware.armed and firmware.mode == firmware.guided, 6.0)
    rig.run(1.1)  # its heartbeat reports it once a second
    assert rig.mode == "TAKING_OFF"
    rig.link.sent.clear()
    return firmware


def asked_again(rig) -> list[CommandLong]:
    commands = [m for _, m in rig.sent(CommandLong)]
    armings = [m for m in commands if m.command == MavCmd.COMPONENT_ARM_DISARM and m.param1 == 1.0]
    return armings + [m for m in commands if m.command in _RESTARTS]


def is_given_up(rig) -> bool:
    return any("was disarmed while it takes off: not ours to fly until RESUME" in text for text in rig.texts)


def stop(rig, mode):
    """Change the vehicle's mode from elsewhere, permanently."""
    firmware = begin(rig)
    firmware.enter(mode)
    rig.run(4.0)
    assert not asked_again(rig)
    assert firmware.mode == (mode if firmware.armed else firmware.mode)


def test_a_hold_stays(rig):
    stop(rig, _HOLD[rig.flavour])
    assert any("not ours to fly until RESUME" in text for text in rig.texts)


def test_a_landing_ends_on_the_floor(rig):
    stop(rig, _LAND[rig.flavour])
    if rig.flavour == Flavour.PX4:
        rig.until(lambda: rig.mode == "LANDED", 10.0)
    else:
        assert is_given_up(rig)  # it has not left the floor yet, and switches its motors off


def test_motors_that_were_switched_off_stay_off_until_the_next_order(rig):
    firmware = begin(rig)
    firmware.disarm(FORCE)
    rig.run(4.0)
    assert not asked_again(rig) and not firmware.armed
    assert is_given_up(rig)
    rig.order(Verb.LAND)
    rig.until(lambda: rig.mode == "LANDED", 10.0)
    rig.order(Verb.TAKEOFF)
    rig.until(lambda: rig.mode == "HOVER", 15.0)


def test_a_vehicle_that_restarts_while_it_takes_off_is_not_armed(rig):
    """Its estimator has only just started: the vehicle would drift away, and be landed."""
    rig.connect()
    rig.run(8.0)
    began, tell = rig.hand.now, rig.emulator.speaker.local_position
    rig.emulator.firmware.arming_fault = lambda: "not yet"
    rig.order(Verb.TAKEOFF)
    rig.run(0.5)
    rig.emulator.speaker.builders[LocalPositionNed] = lambda: (
        (m := tell()) and m._replace(time_boot_ms=(rig.hand.now - began) // 1_000_000)
    )
    rig.run(0.5)
    del rig.emulator.firmware.arming_fault
    rig.run(8.0)
    assert not rig.emulator.firmware.armed and rig.mode != "HOVER"
    assert sum("it was started anew while it takes off" in text for text in rig.texts) == 1
