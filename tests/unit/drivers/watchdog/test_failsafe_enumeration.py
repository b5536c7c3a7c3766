"""Every deviation, alone and with every other, for 16 s: those that must stop a vehicle do so in time and for good."""

import itertools
import re
from dataclasses import dataclass
from typing import Any

import pytest

from drivers.failsafe_table import Condition, Reaction, failsafes
from drivers.watchdog_types import FREE, Action, DriverMode, Upstream, WatchdogLimits
from groundstation.bus.messages import AckStage, FlightState, Verb

S = 1_000_000_000
TURN_S = 0.1
LONG_S = 16.0
DOWN = {Action.LAND, Action.IDLE, Action.CUT}
TABLE = failsafes(WatchdogLimits())


@dataclass(frozen=True)
class Deviation:
    """A fault in a share of each period; times after which the vehicle must not fly, and must be landing.

    values: attributes of the bench that differ. These times are promises of the documentation, not those of the table.
    """

    values: dict[str, Any]
    hover_s: float | None
    land_s: float | None
    conditions: tuple[Condition, ...]
    wrong_s: float = 1.0
    period_s: float = 1.0

    def is_on(self, turn: int) -> bool:
        return turn % round(self.period_s / TURN_S) < round(self.wrong_s / TURN_S)


def always(hover_s, land_s, *conditions, **values):
    return Deviation(values, hover_s, land_s, conditions)


def partly(wrong_s, period_s, hover_s, land_s, *conditions, **values):
    return Deviation(values, hover_s, land_s, conditions, wrong_s, period_s)


LOST = Condition.TELEMETRY_SILENT
BLIND = (LOST, Condition.BLIND)
TRACKER = (
    Condition.TRACKER_SILENT, Condition.TRACKER_RESTARTED, Condition.TRACKER_PAUSED, Condition.NOT_RESUMED,
    Condition.SETPOINTS_PATCHY,
)  # fmt: skip
DEVIATIONS = {
    "told to stop": always(0.1, 0.1, Condition.STOP_REQUESTED, upstream=Upstream(stop_requested=True)),
    "supervisor dead": always(0.1, 1.2, Condition.SUPERVISOR_DEAD, upstream=Upstream(supervisor_alive=False)),
    "supervisor frozen": always(0.1, 2.9, Condition.SUPERVISOR_SILENT, upstream=Upstream(supervisor_fresh=False)),
    "telemetry gone": always(0.1, 2.9, LOST, fresh=False),
    "telemetry for 0.3 s of each second": partly(0.7, 1.0, 3.0, 6.5, LOST, fresh=False),
    "velocity stuck": always(0.1, 2.9, LOST, unsound="its velocity is stuck at 0.00 m/s"),
    "velocity stuck now and then": partly(0.8, 1.0, 3.0, 6.5, LOST, unsound="its velocity is stuck at 0.00 m/s"),
    "velocity stuck, no camera": always(0.1, 1.8, *BLIND, unsound="its velocity is stuck at 0.00 m/s", seen=False),
    "state UNKNOWN": always(0.5, 2.9, Condition.STATE_UNKNOWN, state=FlightState.UNKNOWN),
    "state LOST": always(0.5, 2.9, Condition.STATE_UNKNOWN, state=FlightState.LOST),
    "an emergency": always(0.1, 0.1, Condition.EMERGENCY, state=FlightState.EMERGENCY),
    "it lands": always(0.1, 0.1, Condition.LANDS_BY_ITSELF, state=FlightState.LANDING),
    "it flies home": always(0.1, 0.1, Condition.FLIES_HOME, homeward="RTL"),
    "battery low": always(3.2, 3.2, Condition.BATTERY_LOW, battery=0.1),
    "battery low but for moments": partly(2.9, 3.0, 3.5, 3.5, Condition.BATTERY_LOW, battery=0.1),
    "battery unknown": always(3.2, 3.2, Condition.BATTERY_UNKNOWN, battery=None),
    "no setpoints": always(0.5, 3.2, *TRACKER, tracker_speaks=False),
    "setpoints 0.1 of each 0.5 s": partly(0.4, 0.5, 4.5, 7.8, *TRACKER, tracker_speaks=False),
    "another tracker's setpoints": always(0.1, 3.2, *TRACKER, epoch=2),
    "unconverged": always(0.1, 10.2, Condition.UNCONVERGED, converged=False),
    "unconverged mostly": partly(0.9, 1.0, None, 14.5, Condition.UNCONVERGED, converged=False),
    "no camera sees it": always(None, 10.2, Condition.NOT_SEEN, unseen=True),
    "no position for it": always(0.5, 0.9, Condition.UNLOCATED, lost=True),
    "it strays": always(0.1, 1.8, Condition.STRAYS, stray="1.2 m/s instead of 0.3 m/s"),
    "too fast": always(0.3, 1.8, Condition.TOO_FAST, speed=1.6),
    "too fast now and then": partly(0.3, 0.5, 3.0, 5.0, Condition.TOO_FAST, speed=1.6),
    "flown too fast": always(0.3, 0.3, Condition.FLOWN_TOO_FAST, speed=1.6, foreign=True),
    "another too near": always(None, 2.2, Condition.CROWDED, crowded="drone_2 flies 0.41 m from it"),
    "another too near mostly": partly(0.8, 1.0, None, 4.5, Condition.CROWDED, crowded="drone_2 flies 0.41 m from it"),
    "outside the fence": always(1.2, 3.2, Condition.OUTSIDE, outside="it is 0.4 m outside the fence"),
    "outside the fence mostly": partly(0.8, 1.0, 2.5, 5.5, Condition.OUTSIDE, outside="it is 0.4 m outside the fence"),
    "flown out of the fence": always(0.7, 0.7, Condition.FLOWN_OUTSIDE, outside="it is 0.4 m above it", foreign=True),
    "down on the floor": always(0.5, 0.5, Condition.ON_FLOOR, on_floor=True),
    "flies away, in no landing": always(None, None, away="it rises at 0.9 m/s"),
    "not ready for a take-off": always(None, None, not_ready="configuring"),
    "somebody over its pad": always(None, None, near="drone_2 flies 0.2 m from its pad"),
    "no lease": always(None, None, lease_alive=False),
    "a short pause each second": partly(0.2, 1.0, None, None, *TRACKER, tracker_speaks=False),
    "telemetry missing 0.1 s each second": partly(0.1, 1.0, None, None, LOST, fresh=False),
}  # fmt: skip
ORDERS = {DriverMode.TRACK: Verb.TRACK, DriverMode.HOLD: Verb.HOLD}


def named(reason, conditions):
    """Return whether the reason is the text of a row for one of the conditions."""
    rows = (row for row in TABLE if row.condition in conditions and row.reaction is not Reaction.REFUSE)
    return any(re.match(re.escape(row.text).replace(r"\{why\}", ".+"), reason) for row in rows)


# A silent vehicle cannot report other faults.
HIDES = {
    "fresh": {"state", "homeward"},
    "unsound": {"state", "homeward"},
    "tracker_speaks": {"epoch", "converged"},
    "epoch": {"converged"},
}


def fly(bench, mode):
    assert bench.order(Verb.TAKEOFF).stage is AckStage.ACCEPTED
    bench.step(round(TURN_S * S))
    bench.state, bench.tracker_speaks = FlightState.HOVERING, True
    bench.step(round(TURN_S * S))
    if mode in ORDERS:
        assert bench.order(ORDERS[mode]).stage is AckStage.ACCEPTED
        bench.step(round(TURN_S * S))
    assert bench.decision.mode is mode
    return bench


def soonest(deviations, which):
    hidden = {name for one in deviations for key in one.values for name in HIDES.get(key, ())}
    seen = [one for one in deviations if not hidden & one.values.keys()]
    return min((limit for one in seen if (limit := getattr(one, which)) is not None), default=None)


def run(bench, deviations, resume_s):
    """Fly 16 s; a RESUME at `resume_s` succeeds if permitted. Yields (seconds, decision, resumed)."""
    usual = {name: getattr(bench, name) for one in deviations for name in one.values}
    resumed = False
    for turn in range(round(LONG_S / TURN_S)):
        for name, value in usual.items():
            setattr(bench, name, value)
        for one in deviations:
            if one.is_on(turn):
                for name, value in one.values.items():
                    setattr(bench, name, value)
        if resume_s is not None and turn == round(resume_s / TURN_S):
            bench.see()
            resumed = bench.order(Verb.RESUME).stage is AckStage.ACCEPTED
        yield turn * TURN_S, bench.step(round(TURN_S * S)), resumed


def judge(bench, deviations, resume_s=None):
    hover_s, land_s = soonest(deviations, "hover_s"), soonest(deviations, "land_s")
    conditions = {condition for one in deviations for condition in one.conditions}
    delay_s = 0.0 if resume_s is None else resume_s
    mode, down = bench.decision.mode, False
    for now_s, decision, resumed in run(bench, deviations, resume_s):
        case = (round(now_s, 1), decision)
        if decision.mode is not mode:
            if not (resumed and decision.mode is DriverMode.TRACK):
                assert named(decision.reason, conditions), case
            mode = decision.mode
        if hover_s is not None and now_s >= hover_s + delay_s:
            assert decision.action is not Action.FLY, case
        if land_s is not None and now_s >= land_s + delay_s:
            assert decision.action in DOWN, case
        assert not down or decision.action in DOWN, case
        down = decision.action in DOWN
    return mode


@pytest.mark.parametrize("mode", sorted(FREE))
@pytest.mark.parametrize("name", DEVIATIONS)
def test_a_deviation_alone_stops_in_time_or_not_at_all(new_bench, name, mode):
    one = DEVIATIONS[name]
    if mode is not DriverMode.TRACK and name == "setpoints 0.1 of each 0.5 s":
        pytest.skip("it hovers already")
    if mode is DriverMode.HOLD and name == "another tracker's setpoints":
        pytest.skip("on HOLD any tracker will do")
    last = judge(fly(new_bench(), mode), [one])
    if one.hover_s is None and one.land_s is None:
        assert last is mode, "nothing was wrong enough to stop"


@pytest.mark.parametrize("first", DEVIATIONS)
def test_two_deviations_stop_at_least_as_soon_as_each(new_bench, first):
    others = list(DEVIATIONS)[list(DEVIATIONS).index(first) + 1 :]
    for second in others:
        pair = [DEVIATIONS[first], DEVIATIONS[second]]
        if pair[0].values.keys() & pair[1].values.keys():
            continue  # one would mask the other
        judge(fly(new_bench(), DriverMode.TRACK), pair)


@pytest.mark.parametrize("name", DEVIATIONS)
def test_a_resume_in_between_is_refused_or_undone_by_a_named_row_only(new_bench, name):
    if name == "another tracker's setpoints":
        pytest.skip("RESUME is what makes it the tracker")
    for resume_s in (0.8, 2.0):
        judge(fly(new_bench(), DriverMode.TRACK), [DEVIATIONS[name]], resume_s)


# A pause of the radio, and what else may be wrong before, in or after it, or for a while only.
RADIO_S, SOUND_S = 2.0, 1.5
REPORTS = {"fresh", "unsound", "state", "homeward"}
WHILES = [(0.0, LONG_S), (1.0, LONG_S), (RADIO_S, LONG_S), (0.6, 2.6), (2.2, 3.4)]
# What waits for an order once it has lasted for 1.2 s, though it is over.
WAITS = {"supervisor frozen", "no setpoints", "state UNKNOWN", "state LOST", "it strays", "too fast", "told to stop"}


def pause_of_the_radio(bench, one, begin_s, end_s):
    """Fly with a silence of 2 s, and another deviation for a while; yields (seconds, decision)."""
    usual = {name: getattr(bench, name) for name in one.values}
    for turn in range(round(LONG_S / TURN_S)):
        now_s = turn * TURN_S
        on = begin_s <= now_s < end_s and one.is_on(turn)
        for name, value in (one.values if on else usual).items():
            setattr(bench, name, value)
        if "fresh" not in one.values or not on:
            bench.fresh = now_s >= RADIO_S
        yield now_s, bench.step(round(TURN_S * S))


@pytest.mark.parametrize(("begin_s", "end_s"), WHILES)
@pytest.mark.parametrize("name", DEVIATIONS)
def test_after_a_pause_of_the_radio_it_goes_on_only_if_nothing_else_was_wrong(new_bench, name, begin_s, end_s):
    one, bench = DEVIATIONS[name], fly(new_bench(), DriverMode.TRACK)
    lasts, stopped = end_s == LONG_S, False
    shown_s = max(begin_s, RADIO_S) if REPORTS & one.values.keys() else begin_s
    for now_s, decision in pause_of_the_radio(bench, one, begin_s, end_s):
        case = (round(now_s, 1), decision)
        if 0.0 < now_s < RADIO_S + SOUND_S:
            assert decision.action is not Action.FLY, case
        if lasts and one.hover_s is not None and now_s >= max(shown_s + one.hover_s, RADIO_S):
            assert decision.action is not Action.FLY, case
        if lasts and one.land_s is not None and now_s >= shown_s + one.land_s:
            assert decision.action in DOWN, case
        assert not stopped or decision.action in DOWN, case
        stopped = decision.action in DOWN
    if not lasts and name in WAITS:
        assert bench.decision.mode is not DriverMode.TRACK, "it went on by itself"
    if one.hover_s is None and one.land_s is None and "fresh" not in one.values:
        assert bench.decision.action is Action.FLY, "nothing was wrong enough to stop"


# A RESUME after a pause, or the adoption of another tracker, ends that.
PERSISTENT = [name for name, one in DEVIATIONS.items() if one.land_s is not None and not {*one.conditions} & {*TRACKER}]


@pytest.mark.parametrize("period_s", [0.5, 1.3])
@pytest.mark.parametrize("verb", [Verb.HOLD, Verb.TRACK, Verb.RESUME])
@pytest.mark.parametrize("name", PERSISTENT)
def test_orders_that_are_repeated_put_off_no_landing(new_bench, name, verb, period_s):
    one, bench, landed_s = DEVIATIONS[name], fly(new_bench(), DriverMode.TRACK), None
    usual = {value: getattr(bench, value) for value in one.values}
    for turn in range(round(LONG_S / TURN_S)):
        for value, now in (one.values if one.is_on(turn) else usual).items():
            setattr(bench, value, now)
        if turn and turn % round(period_s / TURN_S) == 0:
            bench.see()
            bench.order(verb)
        lands = bench.step(round(TURN_S * S)).action in DOWN
        landed_s = turn * TURN_S if lands and landed_s is None else landed_s
        assert lands or landed_s is None, "an order undid the landing"
    # The first one after a second outside the fence gives it the time to come back.
    more_s = 1.0 + period_s if Condition.OUTSIDE in one.conditions and verb is not Verb.HOLD else 0.0
    assert landed_s is not None and landed_s <= one.land_s + more_s + 0.1


def test_pairs_of_the_same_input_are_few():
    hidden = sum(bool(a.values.keys() & b.values.keys()) for a, b in itertools.combinations(DEVIATIONS.values(), 2))
    assert hidden <= 30
