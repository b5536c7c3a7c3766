"""A drone that sees no floor and then says nothing any more is braked on by its driver; one that sees holds itself."""

import time

import pytest

from groundstation.bus.messages import Verb

HOLDS_ITSELF = "0,0,0,0,0"


@pytest.mark.parametrize(("lie", "braked"), [("stuck", True), ("", False)])
def test_who_was_blind_as_it_fell_silent_is_braked_on(rig, monkeypatch, lie, braked):
    rig.take_off()
    rig.tracking = True
    rig.order(Verb.TRACK)
    rig.until(lambda: rig.decision.action == "FLY")
    rig.fake.lie = lie
    for _ in range(20):
        rig.turn()
        time.sleep(0.01)
    monkeypatch.setattr(rig.fake, "packet", lambda: b"")  # too short to be heard
    until = time.monotonic() + 0.6
    while time.monotonic() < until:
        rig.turn(settle=False)
        time.sleep(0.01)
    assert rig.decision.action == "HOVER" and not rig.host.watchdog.vehicle.fresh
    assert (rig.fake.said("PCMD")[-1] != HOLDS_ITSELF) is braked
