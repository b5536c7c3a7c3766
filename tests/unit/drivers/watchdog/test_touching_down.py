"""No order makes a drone fly on that touches down; every stop is obeyed."""

import pytest

from drivers.watchdog_types import Action, DriverMode
from groundstation.bus.messages import AckStage, Verb


@pytest.fixture
def low(new_bench):
    """Return a tracking drone that comes down to the floor without an order of ours."""
    bench = new_bench().fly()
    bench.touches_down = True
    bench.step()
    return bench


@pytest.mark.parametrize("verb", [Verb.RESUME, Verb.TRACK])
@pytest.mark.parametrize("held", [False, True])
def test_it_is_to_land_first(low, verb, held):
    if held:
        assert low.order(Verb.HOLD).stage is AckStage.ACCEPTED
    mode = low.step().mode
    answer = low.order(verb)
    assert answer.stage is AckStage.REFUSED
    assert answer.reason == "it is touching down: let it land, then take off again"
    assert low.step().mode is mode


def test_it_goes_on_once_it_is_higher(low):
    low.touches_down = False
    low.see()
    assert low.order(Verb.RESUME).stage is AckStage.ACCEPTED
    assert low.step().action is Action.FLY


@pytest.mark.parametrize(
    ("verb", "mode"),
    [(Verb.HOLD, DriverMode.HOLD), (Verb.LAND, DriverMode.LANDING), (Verb.CUT_MOTORS, DriverMode.CUT)],
)
def test_stops_are_obeyed(low, verb, mode):
    assert low.order(verb, issuer="anyone").stage is AckStage.ACCEPTED
    assert low.step().mode is mode


def test_one_that_stays_on_the_floor_is_landed(low):
    low.on_floor = True
    low.run(0.25)
    assert low.decision.mode is DriverMode.TRACK
    low.run(0.15)
    assert low.decision.action is Action.LAND and low.decision.reason == "it has come down to the floor"
    assert low.order(Verb.RESUME).reason == "the vehicle is LANDING"
