"""What recordings of real vehicles show and emulated ones do not do by themselves."""

from drivers.mavlink.links.seam import Heard
from drivers.mavlink.wire.frames import ReceivedFrame
from drivers.mavlink.wire.telemetry import Heartbeat


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
