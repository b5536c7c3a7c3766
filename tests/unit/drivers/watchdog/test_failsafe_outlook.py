"""The watchdog's report: the reason for a hover, and the time of a landing to come."""

import pytest

from drivers.watchdog_types import DriverMode, Upstream
from groundstation.bus.messages import Verb


def test_a_healthy_flight_expects_no_landing(new_bench):
    bench = new_bench().fly()
    bench.run(2.0)
    assert bench.watchdog.lands_in_s is None
    assert bench.watchdog.explanation == "tracking for op" and not bench.watchdog.braked


def test_a_usual_take_off_expects_no_landing(new_bench):
    bench = new_bench()
    bench.order(Verb.TAKEOFF)
    bench.run(5.0)
    assert bench.watchdog.mode is DriverMode.TAKING_OFF and bench.watchdog.lands_in_s is None
    bench.run(3.0)
    assert bench.watchdog.lands_in_s == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(
    ("fault", "why"),
    [
        ({"fresh": False}, "no telemetry from the vehicle"),
        ({"tracker_speaks": False}, "the tracker sends it no velocity"),
        ({"upstream": Upstream(supervisor_fresh=False)}, "the supervisor does not answer"),
        ({"unsound": "its velocity is stuck at 0.00 m/s"}, "its sensors cannot be believed: its velocity is stuck"),
    ],
)
def test_it_lands_when_it_said_that_it_would(new_bench, fault, why):
    bench = new_bench().fly()
    for name, value in fault.items():
        setattr(bench, name, value)
    bench.run(0.45)
    expected_s = bench.watchdog.lands_in_s
    assert bench.watchdog.explanation.removeprefix("hovers: ").startswith(why)
    waited_s = 0.0
    while bench.watchdog.mode is not DriverMode.LANDING and waited_s < 5.0:
        left_s = bench.watchdog.lands_in_s
        assert left_s == pytest.approx(expected_s - waited_s, abs=0.05)
        bench.step()
        waited_s += 0.033
    assert waited_s == pytest.approx(expected_s, abs=0.05)


def test_an_unseen_drone_says_when_it_will_land_from_when_it_is_lost(new_bench):
    bench = new_bench().fly()
    bench.unseen = True
    bench.run(2.9)
    assert bench.watchdog.lands_in_s is None
    bench.run(0.2)
    assert bench.watchdog.lands_in_s == pytest.approx(7.0, abs=0.2)
    assert bench.watchdog.explanation == "not seen by any camera for too long" and not bench.watchdog.braked
    bench.unseen = False
    bench.run(0.1)
    assert bench.watchdog.lands_in_s is None and bench.watchdog.explanation == "tracking for op"


def test_a_landing_is_no_longer_announced_once_its_condition_is_over(new_bench):
    bench = new_bench().fly()
    bench.tracker_speaks = False
    bench.run(0.45)
    assert bench.watchdog.lands_in_s is not None
    assert bench.watchdog.braked and bench.watchdog.mode is DriverMode.TRACK
    bench.tracker_speaks = True
    bench.run(0.3)
    assert bench.watchdog.lands_in_s is None and not bench.watchdog.braked
