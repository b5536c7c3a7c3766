"""A landing that does not come down is told, as long as that lasts; a healthy one is not."""

from typing import Any

import pytest

from drivers.coming_down import ComingDown, away
from drivers.failsafe_table import Condition
from drivers.watchdog_types import Action, DriverMode
from groundstation.bus.messages import EntityEstimate, FlightState, Verb

RISES = "it rises at 0.9 m/s"


@pytest.fixture
def landing(new_bench):
    bench = new_bench().fly()
    bench.order(Verb.LAND)
    bench.state = FlightState.LANDING
    assert bench.step().action is Action.LAND
    return bench


def test_one_that_rises_is_told_after_two_seconds_and_gets_land_all_the_time(landing):
    landing.away = RISES
    assert set(landing.run(1.9)) == {Action.LAND} and landing.watchdog.told == ""
    assert set(landing.run(0.2)) == {Action.LAND}
    assert landing.watchdog.told == Condition.FLIES_AWAY
    assert landing.watchdog.explanation == f"it does not come down: {RISES}"
    assert not landing.watchdog.braked and landing.watchdog.lands_in_s is None
    assert (landing.watchdog.reason, landing.watchdog.failsafe) == ("landing for op", "")


@pytest.mark.parametrize(("rises_s", "sinks_s"), [(3.0, 0.1), (1.5, 6.0)], ids=["told before", "brakes for a while"])
def test_one_that_sinks_is_not_told_or_no_more(landing, rises_s, sinks_s):
    landing.away = RISES
    landing.run(rises_s)
    landing.away = ""
    landing.run(sinks_s)
    assert (landing.watchdog.told, landing.watchdog.explanation) == ("", "landing for op")


@pytest.mark.parametrize(("height_m", "time_s"), [(1.2, 9.0), (3.0, 15.0)])
def test_one_that_does_not_say_that_it_has_landed_is_told_by_its_height(new_bench, height_m, time_s):
    bench = new_bench().fly()
    bench.height = height_m
    bench.see()
    bench.order(Verb.LAND)
    bench.height, bench.state = 0.0, FlightState.LANDING
    bench.run(time_s - 0.2)
    assert bench.watchdog.told == ""
    bench.run(0.4)
    assert bench.watchdog.told == Condition.LANDING_OVERDUE
    assert bench.watchdog.explanation == "it does not come down: it should have landed by now"
    bench.state = FlightState.LANDED
    assert bench.step().mode is DriverMode.LANDED and bench.watchdog.told == ""


def test_one_that_stands_on_the_floor_and_does_not_stop_its_motors_is_told_as_that(landing):
    landing.run(2.0)
    landing.on_floor = True
    landing.run(4.9)
    assert landing.watchdog.told == ""
    assert set(landing.run(20.0)) == {Action.LAND}
    assert landing.watchdog.told == Condition.STANDS_RUNNING
    assert landing.watchdog.explanation == "it stands on the floor with running motors: CUT MOTORS stops them"
    landing.on_floor = False
    landing.run(6.0)
    assert landing.watchdog.told == Condition.LANDING_OVERDUE, "it flies again"
    landing.on_floor, landing.state = True, FlightState.LANDED
    assert landing.step().mode is DriverMode.LANDED and landing.watchdog.told == ""


def test_a_take_off_that_took_too_long_is_told_if_the_motors_turn_on(new_bench):
    bench = new_bench()
    bench.height = 0.0
    bench.order(Verb.TAKEOFF)
    bench.state = FlightState.TAKING_OFF
    bench.run(10.2)
    assert bench.watchdog.failsafe == Condition.TAKE_OFF_OVERDUE
    bench.run(5.1)
    assert bench.watchdog.told == Condition.LANDING_OVERDUE


def test_one_whose_sensors_are_wrong_is_late_as_well(landing):
    landing.unsound = "it claims a tilt of 60 deg, which it cannot do"
    landing.run(9.2)
    assert landing.watchdog.told == Condition.LANDING_OVERDUE


def test_one_that_a_pilot_flies_is_late_only_some_time_after_the_pilot_has_let_go(landing):
    landing.piloted, landing.away = True, "it flies at 1.5 m/s"
    landing.run(30.0)
    assert landing.watchdog.told == ""
    landing.piloted, landing.away = False, ""
    landing.run(8.8)
    assert landing.watchdog.told == ""
    landing.run(0.4)
    assert landing.watchdog.told == Condition.LANDING_OVERDUE


def test_a_silent_one_is_not_said_to_be_late(landing):
    landing.fresh = False
    landing.run(20.0)
    assert landing.watchdog.told == ""


@pytest.mark.parametrize("mode", [DriverMode.TRACK, DriverMode.CUT])
def test_nobody_else_is_told(new_bench, mode):
    bench = new_bench().fly()
    bench.away = RISES
    if mode is DriverMode.CUT:
        bench.order(Verb.CUT_MOTORS)
        bench.state = FlightState.EMERGENCY
    bench.run(5.0)
    assert bench.watchdog.mode is mode and bench.watchdog.told == ""


@pytest.mark.parametrize(
    ("seen", "climb", "words"),
    [
        (None, None, ""),
        ((0.0, 0.0), 0.31, "it rises at 0.3 m/s"),
        (None, 0.3, ""),
        ((0.8, 0.8), None, "it flies at 1.1 m/s"),
        ((0.8, 0.8), -0.2, "it flies at 1.1 m/s"),
        ((0.8, 0.8), -0.21, ""),  # blown by the wind, on its way down
        ((0.7, 0.6), 0.0, ""),
    ],
)
def test_who_rises_or_flies_fast_without_sinking_flies_away(seen, climb, words):
    assert away(seen, climb, 0.98) == words


def test_its_height_is_that_of_the_last_estimate_or_that_of_a_room():
    down = ComingDown()
    assert down.height_m == 3.0
    for z, height_m in ((1.4, 1.4), (-0.2, 0.0)):
        known: dict[str, Any] = {"mean": (0.0, 0.0, z, 0.0), "covariance": (1e-4,) * 16, "converged": True}
        down.hear(EntityEstimate(name="v", kind="robot", velocity_m_s=(0.0, 0.0, 0.0), age_s=0.1, **known))
        assert down.height_m == height_m
    shapeless = EntityEstimate(
        name="v", kind="robot", velocity_m_s=(), age_s=0.1, mean=(), covariance=(), converged=True
    )
    down.hear(shapeless)
    assert down.height_m == 0.0
