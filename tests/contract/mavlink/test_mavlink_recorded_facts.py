"""What recordings of real vehicles show and emulated ones do not do by themselves."""

from drivers.mavlink.links.seam import Heard
from drivers.mavlink.wire.frames import ReceivedFrame
from drivers.mavlink.wire.telemetry import AttitudeQuaternion, ExtendedSysState, Heartbeat, LocalPositionNed


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
