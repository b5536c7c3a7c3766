"""What recordings of real vehicles show and emulated ones do not do by themselves."""

from drivers.mavlink.links.seam import Heard
from drivers.mavlink.wire.frames import ReceivedFrame
from drivers.mavlink.wire.names import ARMED, CopterMode, Flavour, Px4Main, px4_mode
from drivers.mavlink.wire.telemetry import AttitudeQuaternion, ExtendedSysState, Heartbeat, LocalPositionNed

POSITION = {Flavour.PX4: px4_mode(Px4Main.POSITION), Flavour.ARDUPILOT: CopterMode.LOITER}
OF_ITS_OWN = "its autopilot reports a failsafe of its own, in "


def beat(rig, status, armed=True):
    message = Heartbeat(2, rig.flavour, 1 | (ARMED if armed else 0), POSITION[rig.flavour], status)
    rig.vehicle.take(Heard(rig.hand.now, ReceivedFrame(11, 1, 0, message)))
    rig.emulator.speaker.builders[Heartbeat] = lambda: message


def told(rig):
    return [text for text in rig.texts if text.startswith(OF_ITS_OWN)]


def test_a_failsafe_of_the_autopilot_is_told_by_its_heartbeat_alone(rig):
    """A PX4 that lost OFFBOARD went to POSITION, critical; the radio lost its text."""
    rig.track_on()
    beat(rig, 4)
    rig.run(1.0)
    assert not told(rig)
    beat(rig, 5)
    rig.run(3.0)
    name = {Flavour.PX4: "POSITION", Flavour.ARDUPILOT: "LOITER"}[rig.flavour]
    assert told(rig) == [OF_ITS_OWN + name]
    beat(rig, 4)
    rig.run(1.1)
    beat(rig, 5)
    rig.run(1.1)
    assert len(told(rig)) == 2


def test_a_failsafe_on_the_floor_with_motors_off_is_none(rig):
    """An ArduCopter without its transmitter says critical all the time it stands."""
    rig.connect()
    beat(rig, 5, armed=False)
    rig.run(3.0)
    assert not told(rig)


def test_an_attitude_that_stays_away_is_missed_by_name_and_its_sensor_is_not_blamed(rig):
    rig.track_on()
    rig.run(1.0)
    rig.emulator.speaker.builders[AttitudeQuaternion] = lambda: None
    rig.run(0.6)
    view = rig.host.watchdog.vehicle
    assert not view.fresh and not view.unsound and view.silence == "its attitude stays away"
    rig.until(lambda: rig.mode == "LANDING", 4.0)
    assert "its attitude stays away" in rig.host.watchdog.reason


def test_one_that_is_heard_but_does_not_hear_us_is_told_as_that(rig):
    for kind in (ExtendedSysState, LocalPositionNed, AttitudeQuaternion):
        rig.emulator.speaker.builders[kind] = lambda: None
    rig.run(6.0)
    (text,) = [text for text in rig.process.texts if "trying on" in text]
    assert "it is heard, but sends nothing that it is asked for" in text and "does not answer" not in text


def test_gaps_in_the_numbers_of_another_component_are_no_losses(rig):
    """Of a device on board an ArduPilot's radio passes on one frame of forty."""
    rig.connect()
    number, message = 0, Heartbeat(2, 8, 0, 0, 3)
    for _ in range(50):
        number = (number + 40) % 256
        rig.vehicle.take(Heard(rig.hand.now, ReceivedFrame(11, 0, number, message)))
        rig.run(0.02)
    health = rig.vehicle.health(rig.hand.now)
    assert health.link_quality is not None and health.link_quality > 0.99
