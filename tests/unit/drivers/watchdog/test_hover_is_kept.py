"""In HOVER and HOLD the tracker may return a vehicle to its place, within limits, while nothing is wrong."""

import pytest

from drivers.watchdog_types import Action, DriverMode, Upstream
from groundstation.bus.messages import FlightState, Verb


def hovering(bench, verb=None):
    bench.fly()
    bench.holds = True
    bench.order(verb or Verb.HOLD)
    bench.step()
    return bench


def waiting(bench):
    """Return a bench in HOVER, before TRACK."""
    bench.order(Verb.TAKEOFF)
    bench.state = FlightState.TAKING_OFF
    bench.step()
    bench.state, bench.tracker_speaks, bench.holds = FlightState.HOVERING, True, True
    bench.run(0.2)
    return bench


def test_it_is_brought_back_while_it_holds(new_bench):
    bench = hovering(new_bench())
    assert bench.decision.mode is DriverMode.HOLD and bench.decision.action is Action.HOVER
    assert bench.decision.back_m_s == pytest.approx((0.2, 0.0, 0.0))  # 0.3 m/s were requested


def test_it_is_brought_back_while_it_waits_for_track(new_bench):
    bench = waiting(new_bench())
    assert bench.decision.mode is DriverMode.HOVER and bench.decision.back_m_s == pytest.approx((0.2, 0.0, 0.0))


def test_the_plans_setpoints_move_nobody_who_hovers(new_bench):
    bench = hovering(new_bench())
    bench.holds = False
    assert bench.step().back_m_s is None


def test_hold_works_without_a_tracker(new_bench):
    bench = hovering(new_bench())
    bench.tracker_speaks = False
    bench.run(0.35)
    assert bench.decision.mode is DriverMode.HOLD and bench.decision.action is Action.HOVER
    assert bench.decision.back_m_s is None


def test_a_tracker_that_was_started_again_brings_nobody_back(new_bench):
    bench = hovering(new_bench())
    bench.epoch = 2
    bench.run(0.1)
    assert bench.decision.back_m_s is None


@pytest.mark.parametrize(
    "wrong",
    [
        {"fresh": False}, {"unsound": "its velocity is stuck"}, {"converged": False}, {"stray": "1 m/s"},
        {"state": FlightState.UNKNOWN}, {"state": FlightState.TAKING_OFF},
        {"upstream": Upstream(supervisor_fresh=False)}, {"upstream": Upstream(stop_requested=True)},
    ],
    ids=str,
)  # fmt: skip
def test_conditions_that_stop_tracking_prevent_moves_of_a_hovering_vehicle(new_bench, wrong):
    bench = hovering(new_bench())
    for name, value in wrong.items():
        setattr(bench, name, value)
    bench.run(0.1)
    assert bench.decision.back_m_s is None


def test_a_vehicle_stopped_by_a_failsafe_is_not_moved(new_bench):
    bench = new_bench().fly()
    bench.stray = "1.0 m/s seen by cameras, 0.0 m/s asked"
    bench.step()
    bench.stray, bench.holds = "", True
    assert bench.step().mode is DriverMode.HOVER and bench.watchdog.failsafe
    assert bench.decision.back_m_s is None


def test_a_landing_is_not_steered(new_bench):
    bench = hovering(new_bench())
    bench.order(Verb.LAND)
    assert bench.step().back_m_s is None and bench.decision.action is Action.LAND
