"""The driver brakes a silent or frozen drone that last saw no floor; one that saw it is left to its own hover."""

import time

import pytest

from groundstation.bus.messages import Verb

HOLDS_ITSELF = "0,0,0,0,0"


def turn_for(rig, seconds, settle=True):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        rig.turn(settle)
        time.sleep(0.01)


@pytest.mark.parametrize("then", ["silent", "frozen"])
@pytest.mark.parametrize(("lie", "braked"), [("stuck", True), ("", False)])
def test_a_drone_that_saw_no_floor_before_falling_silent_is_braked(rig, monkeypatch, lie, then, braked):
    rig.take_off()
    rig.tracking = True
    rig.order(Verb.TRACK)
    rig.until(lambda: rig.decision.action == "FLY")
    rig.fake.lie = lie
    turn_for(rig, 0.2)
    if then == "silent":
        monkeypatch.setattr(rig.fake, "packet", lambda: b"")  # too short to be heard
    else:
        rig.fake.lie = "frozen"
    turn_for(rig, 0.8, settle=then == "frozen")
    assert rig.decision.action == "HOVER" and not rig.host.watchdog.vehicle.fresh
    assert (rig.fake.said("PCMD")[-1] != HOLDS_ITSELF) is braked
