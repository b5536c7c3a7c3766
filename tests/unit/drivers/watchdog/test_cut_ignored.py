"""A vehicle that flies on although its motors were cut is landed; one that fell is left alone."""

import pytest

from drivers.failsafe_table import Condition
from drivers.watchdog_types import Action, DriverMode, Upstream
from groundstation.bus.messages import AckStage, FlightState, Verb


def cut(bench):
    bench.fly()
    assert bench.order(Verb.CUT_MOTORS, issuer="anyone").stage is AckStage.ACCEPTED
    assert bench.step().action is Action.CUT
    return bench


@pytest.mark.parametrize("state", [FlightState.HOVERING, FlightState.FLYING, FlightState.TAKING_OFF])
def test_one_that_flies_on_is_landed_after_two_seconds(new_bench, state):
    bench = cut(new_bench())
    bench.state = state
    assert set(bench.run(1.9)) == {Action.CUT}
    assert bench.watchdog.lands_in_s == pytest.approx(0.1, abs=0.07)
    assert bench.watchdog.explanation == "it flies although its motors were cut"
    assert bench.run(0.2)[-1] is Action.LAND
    assert (bench.watchdog.mode, bench.watchdog.failsafe) == (DriverMode.LANDING, Condition.CUT_IGNORED)
    assert set(bench.run(10)) == {Action.LAND}
    bench.state = FlightState.LANDED
    assert bench.step().mode is DriverMode.LANDED


@pytest.mark.parametrize("state", [FlightState.EMERGENCY, FlightState.LANDED, FlightState.LANDING])
def test_one_that_is_down_or_on_its_way_stays_cut(new_bench, state):
    bench = cut(new_bench())
    bench.state = state
    assert set(bench.run(10)) == {Action.CUT} and bench.watchdog.lands_in_s is None


def test_an_emergency_that_flies_on_is_landed_too(new_bench):
    bench = new_bench().fly()
    bench.state = FlightState.EMERGENCY
    assert bench.step().mode is DriverMode.CUT
    bench.state = FlightState.FLYING
    assert bench.run(2.2)[-1] is Action.LAND


@pytest.mark.parametrize("wrong", [{"battery": 0.05}, {"upstream": Upstream(supervisor_alive=False)}], ids=str)
def test_whatever_else_is_wrong(new_bench, wrong):
    bench = cut(new_bench())
    for name, value in wrong.items():
        setattr(bench, name, value)
    assert bench.run(2.2)[-1] is Action.LAND


def test_a_silent_one_is_landed_once_it_is_heard_to_fly(new_bench):
    bench = cut(new_bench())
    bench.fresh = False
    assert set(bench.run(5)) == {Action.CUT}, "it may have fallen; CUT goes before LAND"
    assert bench.order(Verb.LAND).reason == "motors are cut"
    bench.fresh = True
    assert bench.run(2.2)[-1] is Action.LAND


def test_land_is_obeyed_once_the_cut_has_had_its_time(new_bench):
    bench = cut(new_bench())
    assert bench.order(Verb.LAND, issuer="anyone").reason == "motors are being cut"
    assert set(bench.run(1.0)) == {Action.CUT}
    assert bench.order(Verb.LAND, issuer="anyone").stage is AckStage.ACCEPTED
    assert bench.step().action is Action.LAND
    assert (bench.watchdog.reason, bench.watchdog.failsafe) == ("landing for anyone", "")


def test_cuts_that_are_repeated_postpone_no_landing_and_one_after_it_cuts_again(new_bench):
    bench = cut(new_bench())
    for _ in range(4):
        bench.run(0.5)
        bench.order(Verb.CUT_MOTORS)
    assert bench.run(0.1)[-1] is Action.CUT, "the last one began anew"
    assert bench.run(2.0)[-1] is Action.LAND
    bench.order(Verb.CUT_MOTORS)
    assert set(bench.run(1.9)) == {Action.CUT}
