"""No accepted command is undone without a true overriding reason: command x history x vehicle state x tracker."""

import copy
import itertools

import pytest

from drivers.failsafe_table import Condition
from drivers.watchdog_types import Action, DriverMode
from groundstation.bus.messages import AIRBORNE, AckStage, FlightState, Verb

MS = 1_000_000
S = 1_000_000_000
TURN = 100 * MS  # coarser than the sender's, to sweep in seconds; finer than the gap that suspends TRACK
NEVER, SPEAKS = "never heard", "speaks"
SILENT_S = {"silent for 0.4 s": 0.4, "silent for 2.4 s": 2.4}
SAID = tuple(state for state in FlightState if state is not FlightState.LOST)  # LOST is set by the host


def turns(bench, seconds):
    for _ in range(round(seconds * S / TURN)):
        bench.step(TURN)


def take_off(bench):
    assert bench.order(Verb.TAKEOFF).stage is AckStage.ACCEPTED
    bench.step(TURN)


def climb(bench):
    take_off(bench)
    bench.state = FlightState.TAKING_OFF
    turns(bench, 0.5)


def hover(bench):
    climb(bench)
    bench.state = FlightState.HOVERING
    turns(bench, 0.5)


def clear_an_emergency(bench):
    bench.state = FlightState.EMERGENCY
    then(lambda _: None, Verb.CUT_MOTORS)(bench)
    take_off(bench)


def then(history, verb):
    def run(bench):
        history(bench)
        assert bench.order(verb).stage is AckStage.ACCEPTED
        turns(bench, 0.2)
        assert bench.decision.mode in OBEYED[verb]

    return run


HISTORIES = {
    "stands": lambda _: None,
    "take-off ordered": take_off,
    "take-off cancelled": then(take_off, Verb.HOLD),
    "take-off clears an emergency": clear_an_emergency,
    "climbs": climb,
    "climbs, held": then(climb, Verb.HOLD),
    "climbs, landing": then(climb, Verb.LAND),
    "hovers": hover,
    "tracks": then(hover, Verb.TRACK),
    "holds": then(hover, Verb.HOLD),
    "lands": then(hover, Verb.LAND),
    "cut": then(hover, Verb.CUT_MOTORS),
}
OBEYED = {
    Verb.TAKEOFF: {DriverMode.TAKING_OFF, DriverMode.HOVER},
    Verb.TRACK: {DriverMode.TRACK},
    Verb.RESUME: {DriverMode.TRACK},
    Verb.HOLD: {DriverMode.HOLD, DriverMode.LANDED},
    Verb.LAND: {DriverMode.LANDING, DriverMode.LANDED},
    Verb.CUT_MOTORS: {DriverMode.CUT},
}


def reach(bench, history, tracker):
    """Bring the bench into that state; returns the tracker's last time [ns], or None."""
    bench.tracker_speaks = tracker is not NEVER
    HISTORIES[history](bench)
    heard_ns = bench.now
    if tracker in SILENT_S:
        bench.tracker_speaks = False
        turns(bench, SILENT_S[tracker])
    return None if tracker is NEVER else heard_ns


def beats_orders(before, decision, said, silent_s, paused_s):
    """Return whether a decision's reason overrides a command, and is true; said: states since the command."""
    grounds = {
        (DriverMode.CUT, "the vehicle reports an emergency"): FlightState.EMERGENCY in said,
        (DriverMode.LANDING, "the vehicle lands by itself"): FlightState.LANDING in said,
        (DriverMode.HOVER, "the vehicle does not say what it does; RESUME is needed"): FlightState.UNKNOWN in said,
        (DriverMode.LANDING, "the tracker sends it no velocity"): silent_s >= 3.0,
        (DriverMode.HOVER, "the tracker sends it no velocity; RESUME is needed"): paused_s >= 0.5,
    }
    if (decision.mode, decision.reason) in grounds:
        return grounds[decision.mode, decision.reason]
    if decision.mode is DriverMode.LANDED:
        return decision.reason.startswith("landed (") and FlightState.LANDED in said
    unordered = before is DriverMode.LANDED and "without a standing take-off order (" in decision.reason
    return unordered and bool(AIRBORNE & said)


@pytest.mark.parametrize("history", HISTORIES)
@pytest.mark.parametrize("tracker", [NEVER, SPEAKS, *SILENT_S])
def test_an_accepted_order_stands_for_a_second_or_what_undid_it_is_named(new_bench, history, tracker):
    bench = new_bench()
    heard_ns = reach(bench, history, tracker)
    dog, now, speaks = bench.watchdog, bench.now, bench.tracker_speaks
    accepted = 0
    for verb, first, later in itertools.product(Verb, SAID, SAID):
        bench.watchdog, bench.now, bench.tracker_speaks = copy.deepcopy(dog), now, speaks
        bench.state = first
        bench.see()
        if bench.order(verb).stage is not AckStage.ACCEPTED:
            continue
        accepted += 1
        before = dog.mode
        for turn in range(11):
            decision = bench.step(TURN if turn else 0)
            bench.state = later
            if decision.mode not in OBEYED[verb]:
                # Without any tracker message, no vehicle here has been in the air for long enough.
                silent_s = 0.0 if speaks or heard_ns is None else (bench.now - heard_ns) / S
                paused_s = min(silent_s, turn * TURN / S)
                case = (verb, first, later, turn, decision.mode, decision.reason)
                assert beats_orders(before, decision, {first, later}, silent_s, paused_s), case
                break
            before = decision.mode
    assert accepted


def test_a_refused_take_off_ends_with_the_vehicles_reason_until_the_next_order(new_bench):
    bench = new_bench()
    bench.order(Verb.TAKEOFF)
    assert bench.step().action is Action.TAKE_OFF
    bench.refuses = "error motor stop"
    decision = bench.step()
    assert (decision.action, bench.watchdog.failsafe) == (Action.LAND, Condition.TAKE_OFF_REFUSED)
    bench.refuses = ""
    assert set(bench.run(20)) == {Action.LAND, Action.IDLE}
    assert bench.watchdog.reason == "landed (it refuses to take off: error motor stop)"
    assert bench.order(Verb.TAKEOFF).stage is AckStage.ACCEPTED
    assert bench.step().action is Action.TAKE_OFF
