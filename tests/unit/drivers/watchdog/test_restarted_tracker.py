"""After a restart of the tracker the drone hovers, says so, and waits for RESUME or HOLD."""

import pytest

from drivers.failsafe_table import Condition
from drivers.watchdog_types import Action, DriverMode
from groundstation.bus.messages import AckStage, FlightState, Verb

RESTARTED = "the tracker restarted; RESUME is needed"


def restarted(bench, silent_s=0.0):
    """Return a bench that tracked when its tracker was started anew, which took that long."""
    bench.fly()
    bench.tracker_speaks = False
    bench.run(silent_s)
    bench.epoch, bench.tracker_speaks = 2, True
    bench.step()
    return bench


def test_a_restart_is_named_and_asks_for_resume_at_once(new_bench):
    bench = restarted(new_bench())
    assert (bench.watchdog.mode, bench.watchdog.explanation) == (DriverMode.HOVER, RESTARTED)
    assert bench.watchdog.failsafe == Condition.TRACKER_RESTARTED


@pytest.mark.parametrize("silent_s", [0.0, 0.4, 2.0])
def test_while_it_waits_that_is_what_it_says_and_it_lands_3_s_after_the_last_setpoint_obeyed(new_bench, silent_s):
    bench = restarted(new_bench(), silent_s)
    bench.run(0.4)
    assert bench.watchdog.explanation == RESTARTED
    left_s = bench.watchdog.lands_in_s
    assert left_s == pytest.approx(3.0 - 0.4 - silent_s, abs=0.1)
    assert Action.LAND not in bench.run(left_s - 0.1)
    assert bench.run(0.2)[-1] is Action.LAND
    assert bench.watchdog.reason == "the tracker restarted, and nobody ordered RESUME"


def test_resume_lets_it_go_on_and_track_does_not(new_bench):
    bench = restarted(new_bench(), 2.0)
    assert bench.order(Verb.TRACK).stage is AckStage.REFUSED
    assert bench.order(Verb.RESUME).stage is AckStage.ACCEPTED
    assert set(bench.run(5)) == {Action.FLY}


@pytest.mark.parametrize("silent_s", [0.0, 2.0])
def test_hold_keeps_it_up_and_in_its_place_by_its_own_means(new_bench, silent_s):
    bench = restarted(new_bench(), silent_s)
    assert bench.order(Verb.HOLD).stage is AckStage.ACCEPTED
    bench.holds = True
    for _ in range(300):
        decision = bench.step()
        assert (decision.mode, decision.action, decision.back_m_s) == (DriverMode.HOLD, Action.HOVER, None)
    assert bench.order(Verb.RESUME).stage is AckStage.ACCEPTED
    assert bench.step().action is Action.FLY


def test_a_restart_during_hold_lands_nobody_if_it_takes_less_than_3_s(new_bench):
    bench = new_bench().fly()
    bench.order(Verb.HOLD)
    bench.tracker_speaks = False
    bench.run(2.5)
    bench.epoch, bench.tracker_speaks = 2, True
    assert set(bench.run(10)) == {Action.HOVER}
    bench.tracker_speaks = False
    assert bench.run(3.1)[-1] is Action.LAND
    assert bench.watchdog.reason == "the tracker sends it no velocity"


def test_on_hold_a_restarted_tracker_that_does_not_find_it_lands_it(new_bench):
    bench = restarted(new_bench())
    bench.order(Verb.HOLD)
    bench.converged = False
    assert Action.LAND not in bench.run(9.5)
    assert bench.run(0.7)[-1] is Action.LAND and bench.watchdog.failsafe == Condition.UNCONVERGED


def test_a_restart_before_track_is_named_too(new_bench):
    bench = new_bench()
    bench.order(Verb.TAKEOFF)
    bench.step()
    bench.state, bench.tracker_speaks = FlightState.HOVERING, True
    bench.run(0.2)
    bench.epoch = 2
    bench.run(1.0)
    assert bench.watchdog.explanation == RESTARTED and bench.decision.action is Action.HOVER
    assert bench.run(2.2)[-1] is Action.LAND
