"""The driver brakes a silent or frozen drone that last saw no floor; one that saw it is left to its own hover."""

import time

import pytest
from scripted_drone import FLY

from drivers.host import VehicleHost
from drivers.watchdog_types import WatchdogLimits

HOLDS_ITSELF, START = "0,0,0,0,0", "290718208"


def turn_for(rig, seconds, settle=True):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        rig.turn(settle)
        time.sleep(0.01)


@pytest.mark.parametrize("then", ["silent", "frozen"])
@pytest.mark.parametrize(("lie", "braked"), [("stuck", True), ("", False)])
def test_a_drone_that_saw_no_floor_before_falling_silent_is_braked(rig, monkeypatch, lie, then, braked):
    rig.take_off()
    rig.track()
    rig.fake.lie = lie
    turn_for(rig, 0.2)
    if then == "silent":
        monkeypatch.setattr(rig.fake, "packet", lambda: b"")  # too short to be heard
    else:
        rig.fake.lie = "frozen"
    turn_for(rig, 0.8, settle=then == "frozen")
    assert rig.decision.action == "HOVER" and not rig.host.watchdog.vehicle.fresh
    assert (rig.fake.said("PCMD")[-1] != HOLDS_ITSELF) is braked


def test_a_drone_that_landed_while_nobody_heard_it_is_not_lifted_again(rig):
    """Both directions are dead, so it lands by itself; a start bit is a level to it (docs/reference/ardrone.md 2.4)."""
    rig.take_off()
    rig.speaking = False
    until = time.monotonic() + 2.6
    while time.monotonic() < until:
        rig.turn()
        rig.fake._waiting(rig.fake.at)
        time.sleep(0.02)
    rig.fake.state, rig.fake.major = rig.fake.state & ~FLY, 2
    assert rig.decision.action == "HOVER"
    rig.fake.lines.clear()
    rig.turn()
    rig.speaking = True
    rig.until(lambda: rig.decision.mode == "LANDED")
    assert rig.fake.said("PCMD") and START not in rig.fake.said("REF")


def test_a_drone_that_was_shown_to_be_blind_is_believed_that_it_has_landed(new_rig):
    """The doubt lasts until it stands: it must not hide that it does, or its motors would never be said to rest."""
    rig = new_rig()
    rig.host = VehicleHost(rig.process, rig.drone, WatchdogLimits(land_after_s=1.3))
    rig.take_off()
    rig.track()
    rig.drone._attitude._doubt.blind = True  # as cameras show it
    rig.until(lambda: rig.decision.action == "LAND")
    rig.until(lambda: not rig.fake.state & FLY)
    rig.until(lambda: rig.host.watchdog.mode == "LANDED")
    assert rig.drone._attitude.doubted == ""
