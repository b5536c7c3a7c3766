"""Cameras find a vehicle only some time after its lift-off, or never."""

import pytest

from drivers.mavlink.wire.names import Flavour
from groundstation.bus.messages import Verb


def test_a_vehicle_that_no_camera_finds_after_its_lift_off_is_landed_before_it_lands_by_itself(rig):
    """EKF2_NOAID_TOUT lands a PX4 a second after its pad was last sent; an ArduPilot coasts for 8 s."""
    rig.connect()
    rig.order(Verb.TAKEOFF)
    rig.tracking = False
    rig.until(lambda: rig.vehicle.orders.lift.lifted, 10.0)
    lifted = rig.hand.now
    rig.until(lambda: rig.mode == "LANDING", 6.0)
    limit_s = 0.9 if rig.flavour == Flavour.PX4 else 4.7
    assert (rig.hand.now - lifted) / 1e9 == pytest.approx(limit_s, abs=0.1)
    assert rig.host.watchdog.reason == "no position from the cameras since it lifted off"
    rig.until(lambda: rig.mode == "LANDED", 15.0)


def test_a_vehicle_that_is_found_half_a_second_after_its_lift_off_flies_on(rig):
    rig.connect()
    rig.order(Verb.TAKEOFF)
    rig.tracking = False
    rig.until(lambda: rig.vehicle.orders.lift.lifted, 10.0)
    rig.run(0.5)
    rig.tracking = True
    rig.run(4.0)
    assert rig.mode == "HOVER" and rig.body.z > 0.6
