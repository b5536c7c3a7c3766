"""A vehicle that climbs while it believes that it sinks: cameras show it, and a landing that does not help is told."""

import math

import pytest

from drivers.mavlink.wire.names import Landed
from groundstation.bus.messages import Severity, Verb
from groundstation.bus.topics import VEHICLE_STATUS


@pytest.fixture
def runaway(rig, monkeypatch):
    """Return a tracking vehicle whose accelerometers err upwards: from now on it climbs, whatever it is told."""
    rig.track_on()
    rig.run(2.0)
    step, rise, before = rig.copter.step, [0.0], [rig.body.z]

    def err(wake):
        step(wake)
        rise[0] += 0.65 * 0.005
        before[0] += rise[0] * 0.005
        rig.body.z = before[0]

    monkeypatch.setattr(rig.copter, "step", err)
    return rig


def test_a_climb_that_only_cameras_see_makes_it_hover_then_land(runaway):
    rig, began_m = runaway, runaway.body.z
    rig.wanted = ((0.0, 0.0, -0.4), 0.0)
    rig.until(lambda: rig.mode == "HOVER", 2.3)
    assert "up seen by cameras, 0.4 m/s down asked" in rig.host.watchdog.reason
    assert rig.body.z - began_m < 1.7
    rig.until(lambda: rig.mode == "LANDING", 2.0)
    assert rig.host.watchdog.failsafe == "strays"


def test_one_whose_heading_is_the_wrong_way_round_lands(rig):
    """Each correction pushes it further: it swings, and by its report it obeys for a moment at times."""
    rig.track_on()
    rig.turned_rad, rig.wanted = math.pi, ((0.3, 0.0, 0.0), 0.0)
    rig.until(lambda: rig.mode == "HOVER", 2.0)
    rig.until(lambda: rig.mode == "LANDING", 1.7)


def test_a_landing_that_rises_is_told_within_seconds(runaway, monkeypatch):
    rig = runaway
    said = []
    monkeypatch.setattr(rig.process, "event", lambda *event: said.append(event))
    rig.order(Verb.LAND)
    rig.until(lambda: rig.host.watchdog.told, 3.5)
    rig.run(0.5)
    status = rig.messages(VEHICLE_STATUS)[-1]
    assert (status.mode, status.failsafe) == ("LANDING", "flies_away")
    assert status.detail.startswith("it does not come down: it rises at ")
    rig.run(5.0)
    ((_, text, remedy, _),) = [event for event in said if event[0] is Severity.ERROR]
    assert "does not come down" in text and "CUT MOTORS" in remedy


def test_a_landing_that_ends_in_no_landing_is_told_once_its_time_is_over(rig):
    """It hovers on although it accepts LAND."""
    rig.track_on()
    rig.order(Verb.LAND)
    rig.run(0.3)
    rig.copter.step = lambda wake: None
    rig.run(7.0)
    assert rig.host.watchdog.told == ""
    rig.until(lambda: rig.host.watchdog.told == "landing_overdue", 3.0)


def test_one_that_does_not_notice_its_landing_stands_with_running_motors(rig, monkeypatch):
    """As an ArduCopter may for good after late positions."""
    rig.track_on()
    firmware = rig.emulator.firmware
    monkeypatch.setattr(type(firmware), "landed", Landed.IN_AIR)
    monkeypatch.setattr(firmware, "disarm_after_s", lambda: 100.0)
    rig.lingers = True
    rig.order(Verb.LAND)
    rig.until(lambda: rig.host.watchdog.told, 12.0)
    rig.run(0.3)
    status = rig.messages(VEHICLE_STATUS)[-1]
    assert (status.mode, status.failsafe) == ("LANDING", "stands_running")
    assert status.detail == "it stands on the floor with running motors: CUT MOTORS stops them"


def test_healthy_flights_and_landings_are_not_told(rig):
    rig.track_on()
    for climb in (0.4, -0.4, 0.4):
        rig.wanted = ((0.2, 0.0, climb), 0.0)
        rig.run(2.0)
        assert rig.mode == "TRACK", rig.host.watchdog.reason
    rig.order(Verb.LAND)
    rig.until(lambda: rig.mode == "LANDED" or rig.host.watchdog.told, 12.0)
    assert rig.mode == "LANDED"
