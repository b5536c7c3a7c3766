"""A vehicle outside the fence: hovers, then lands; at once if others fly it; a pilot's sticks are left alone."""

import pytest

from drivers.failsafe_table import Condition
from drivers.watchdog_types import Action, DriverMode
from groundstation.bus.messages import AckStage, FlightState, Verb

OUT = "it is 0.4 m outside the fence"


def go_on(bench, verb=Verb.RESUME):
    """Order it to go on, at a setpoint that it has seen."""
    bench.see()
    assert bench.order(verb).stage is AckStage.ACCEPTED


def test_it_hovers_until_resume_and_lands_unless_it_comes_back(new_bench):
    bench = new_bench().fly()
    bench.outside = OUT
    assert set(bench.run(0.9)) == {Action.FLY}
    assert Action.HOVER in bench.run(0.2)
    assert bench.watchdog.failsafe == Condition.OUTSIDE and bench.watchdog.reason == f"{OUT}; RESUME is needed"
    assert bench.watchdog.explanation == OUT and bench.watchdog.lands_in_s == pytest.approx(1.9, abs=0.1)
    assert set(bench.run(1.7)) == {Action.HOVER}
    assert bench.run(0.3)[-1] is Action.LAND
    assert bench.watchdog.mode is DriverMode.LANDING and bench.watchdog.reason == OUT


def test_one_that_is_pushed_out_for_a_moment_flies_on(new_bench):
    bench = new_bench().fly()
    for _ in range(3):
        bench.outside = OUT
        assert set(bench.run(0.8)) == {Action.FLY}
        bench.outside = ""
        assert set(bench.run(4.0)) == {Action.FLY}


def test_a_tracker_may_bring_it_back_once_the_operator_says_so(new_bench):
    bench = new_bench().fly()
    bench.outside = OUT
    bench.run(1.5)
    assert bench.decision.action is Action.HOVER
    go_on(bench)
    assert set(bench.run(0.8)) == {Action.FLY}
    bench.outside = ""  # on its way back
    assert set(bench.run(10.0)) == {Action.FLY}


def test_hold_does_not_keep_it_outside(new_bench):
    bench = new_bench().fly()
    bench.outside = OUT
    for _ in range(4):
        bench.run(0.7)
        bench.see()
        bench.order(Verb.HOLD)
    assert bench.run(0.4)[-1] is Action.LAND


@pytest.mark.parametrize("verb", [Verb.TRACK, Verb.RESUME])
@pytest.mark.parametrize("waited_s", [1.2, 2.8])
def test_an_order_to_go_on_gives_it_the_time_to_come_back(new_bench, verb, waited_s):
    bench = new_bench().fly()
    bench.outside = OUT
    bench.run(waited_s)
    go_on(bench, verb)
    assert set(bench.run(0.9)) == {Action.FLY} and bench.watchdog.lands_in_s == pytest.approx(2.1, abs=0.1)
    assert set(bench.run(2.0)[5:]) == {Action.HOVER}
    assert bench.run(0.3)[-1] is Action.LAND


def test_one_told_to_go_on_that_comes_back_late_flies_on(new_bench):
    bench = new_bench().fly()
    bench.outside = OUT
    bench.run(2.8)
    bench.see()
    bench.order(Verb.RESUME)
    assert set(bench.run(0.8)) == {Action.FLY}
    bench.outside = ""
    assert set(bench.run(30.0)) == {Action.FLY}


def test_orders_to_go_on_that_are_repeated_keep_it_outside_no_longer_than_one(new_bench):
    bench = new_bench().fly()
    bench.outside = OUT
    for _ in range(3):
        bench.run(1.4)
        bench.see()
        bench.order(Verb.RESUME)
    assert bench.run(0.5)[-1] is Action.LAND


def test_an_order_to_go_on_gives_no_time_to_one_that_others_fly(new_bench):
    bench = new_bench().fly()
    bench.outside, bench.foreign = OUT, True
    bench.run(0.3)
    bench.see()
    bench.order(Verb.RESUME)
    assert bench.run(0.3)[-1] is Action.LAND


@pytest.mark.parametrize("mode", ["hover", "hold", "track", "take-off"])
def test_whoever_is_flown_out_by_others_is_landed_at_once(new_bench, mode):
    bench = new_bench()
    bench.order(Verb.TAKEOFF)
    bench.state = FlightState.TAKING_OFF if mode == "take-off" else FlightState.HOVERING
    bench.tracker_speaks = True
    bench.step()
    if mode in ("hold", "track"):
        bench.order(Verb[mode.upper()])
    bench.outside, bench.foreign = OUT, True
    assert Action.LAND not in bench.run(0.45)
    assert bench.run(0.15)[-1] is Action.LAND
    assert bench.watchdog.reason == f"{OUT}, not by our orders"


def test_whoever_ends_a_climb_or_was_just_let_go_of_by_a_pilot_has_the_time_of_our_own(new_bench):
    bench = new_bench().fly()
    bench.outside, bench.foreign, bench.settles = OUT, True, True
    assert Action.LAND not in bench.run(1.5) and bench.watchdog.failsafe == Condition.OUTSIDE
    bench.settles = False
    assert Action.LAND not in bench.run(0.4)
    assert bench.run(0.2)[-1] is Action.LAND


@pytest.mark.parametrize("foreign", [False, True])
def test_a_pilot_may_take_it_anywhere_by_the_sticks(new_bench, foreign):
    bench = new_bench().fly()
    bench.outside, bench.foreign, bench.piloted = OUT, foreign, True
    assert set(bench.run(6.0)) == {Action.FLY}
    bench.piloted = False
    assert bench.run(0.7 if foreign else 3.2)[-1] is Action.LAND


def test_one_that_takes_off_to_the_outside_lands(new_bench):
    bench = new_bench()
    bench.order(Verb.TAKEOFF)
    bench.state, bench.outside = FlightState.TAKING_OFF, OUT
    assert set(bench.run(2.8)) == {Action.TAKE_OFF}
    assert bench.run(0.4)[-1] is Action.LAND


def test_one_that_stands_outside_may_take_off(new_bench):
    """Carried there by hand, by an estimate of its last flight."""
    bench = new_bench()
    bench.outside = OUT
    bench.run(5.0)
    assert bench.watchdog.mode is DriverMode.LANDED
    assert bench.order(Verb.TAKEOFF).stage is AckStage.ACCEPTED


def test_being_outside_does_not_withhold_the_way_back_that_ends_it(new_bench):
    bench = new_bench().fly()
    bench.order(Verb.HOLD)
    bench.holds, bench.outside = True, OUT
    for _ in range(80):
        bench.step()
        assert bench.decision.back_m_s is not None
    assert bench.watchdog.mode is DriverMode.HOLD


@pytest.mark.parametrize("stray_s", [2.3, 2.8])
def test_an_order_to_go_on_from_another_hover_gives_it_the_time_too(new_bench, stray_s):
    bench = new_bench().fly()
    bench.outside, bench.stray, bench.stray_by = OUT, "0.5 m/s, 0.0 m/s asked", "cameras"
    bench.run(0.3)
    bench.stray = bench.stray_by = ""
    bench.run(stray_s - 0.3)
    assert bench.watchdog.failsafe == Condition.STRAYS
    go_on(bench)
    assert set(bench.run(0.9)) == {Action.FLY}


def test_an_order_soon_after_it_went_out_leaves_the_later_one_its_time(new_bench):
    bench = new_bench().fly()
    bench.outside = OUT
    bench.run(0.5)
    bench.see()
    bench.order(Verb.RESUME)
    bench.run(2.0)
    go_on(bench)
    assert set(bench.run(0.9)) == {Action.FLY}
