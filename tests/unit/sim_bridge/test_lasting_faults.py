"""The end of one fault heals no other one of its kind that still lasts."""

import math
from types import SimpleNamespace

import pytest

from sim_bridge.fault_kinds import Fault
from sim_bridge.faults import FaultSchedule
from sim_bridge.link_bursts import with_bursts
from sim_bridge.scenario import Scenario
from sim_bridge.site import Site
from sim_bridge.surroundings import LinkBursts
from sim_bridge.world.world import World

MARKER = {"code": 1, "square_mm": 44, "position_m": [0, 0, 0.08]}
SITE = Site.model_validate(
    {
        "site": "lab",
        "room": {"size_m": [12, 12, 4.5]},
        "drones": {"a": {"kind": "ardrone", "pad_m": (0, 0), "marker": MARKER}},
        "target": {"name": "t", "marker": {"code": 5, "height_m": 0.4, "square_mm": 44}},
    }
)


class Wire(SimpleNamespace):
    def suffer(self, kind, lasting):
        self.blocked = bool(lasting)


def broken(faults, at_s):
    """Return the drone and its emulator at a time."""
    world, wire = World(SITE, Scenario(), 1), Wire(silent=False, deaf=False, blocked=False)
    schedule = FaultSchedule(faults, world, {"a": wire})
    for tenth in range(round(10 * at_s) + 1):
        schedule.apply(0.1 * tenth)
    return world.drones["a"], wire


def two_of(kind, first=None, second=None, **more):
    return (
        Fault(kind=kind, entity="a", value=first, start_s=1.0),
        Fault(kind=kind, entity="a", value=second, start_s=2.0, end_s=3.0, **more),
    )


@pytest.mark.parametrize(
    ("kind", "state"),
    [("navdata_silent", "silent"), ("at_deaf", "deaf"), ("propeller_blocked", "blocked")],
)
def test_a_device_stays_broken_by_the_fault_that_lasts(kind, state):
    _, wire = broken(two_of(kind), at_s=4.0)
    assert getattr(wire, state)


def test_a_uniform_floor_and_an_obstacle_that_last_stay():
    drone, _ = broken((*two_of("uniform_floor", 0, 1), *two_of("obstacle_below", 0.4, 0.2)), at_s=2.5)
    assert drone.autopilot.blind and drone.autopilot.floor_m == pytest.approx(0.6)
    drone, _ = broken((*two_of("uniform_floor", 0, 1), *two_of("obstacle_below", 0.4, 0.2)), at_s=4.0)
    assert drone.autopilot.blind and drone.autopilot.floor_m == 0.4


def test_winds_add_up_and_end_one_by_one():
    winds = two_of("wind", 1.0, 0.2, direction_deg=90.0)
    assert math.dist(broken(winds, at_s=2.5)[0].wind, (1.0, 0.2)) < 1e-9
    assert broken(winds, at_s=4.0)[0].wind == (1.0, 0.0)
    calm = broken([one.model_copy(update={"end_s": 3.5}) for one in winds], at_s=4.0)
    assert calm[0].wind == (0.0, 0.0)


def test_the_end_of_a_burst_gives_no_voice_to_a_silent_vehicle():
    bursts = LinkBursts(per_minute=60.0, from_s=2.0)
    silent = Scenario(faults=two_of("navdata_silent")[:1], link_bursts=bursts)
    for seed in range(5):
        _, wire = broken(with_bursts(silent, ["a"], [], seed).faults, at_s=60.0)
        assert wire.silent
