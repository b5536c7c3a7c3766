"""After a pause of its radio a vehicle goes on by itself, if nothing else was wrong, and not too often."""

import pytest

from drivers.failsafe_table import Condition
from drivers.watchdog_types import Action, DriverMode, Upstream
from groundstation.bus.messages import AckStage, FlightState, Verb

MS = 1_000_000


def silent(bench, seconds):
    bench.fresh = False
    actions = bench.run(seconds)
    bench.fresh = True
    return actions


def waits(bench, failsafe):
    assert set(bench.run(4)) == {Action.HOVER}
    assert (bench.watchdog.mode, bench.watchdog.failsafe) == (DriverMode.HOVER, failsafe)
    assert bench.watchdog.reason.endswith("; RESUME is needed")
    assert bench.order(Verb.RESUME).stage is AckStage.ACCEPTED
    assert bench.step().action is Action.FLY


@pytest.mark.parametrize("silent_s", [1.2, 2.0, 2.5])
def test_it_goes_on_once_its_telemetry_has_lasted(new_bench, silent_s):
    bench = new_bench().fly()
    ordered_ns = bench.decision.entered_ns
    assert set(silent(bench, silent_s)) == {Action.HOVER}
    assert set(bench.run(1.52)) == {Action.HOVER}
    assert bench.watchdog.explanation == "hovers: its telemetry is back, and has to last for 1.5 s"
    assert bench.watchdog.braked and bench.watchdog.mode is DriverMode.TRACK
    assert set(bench.run(60)) == {Action.FLY}
    assert bench.decision.entered_ns == ordered_ns, "for the vehicle this is no new order: a pilot keeps it"


def test_after_less_than_a_second_it_only_has_time_to_stand(new_bench):
    bench = new_bench().fly()
    silent(bench, 0.7)
    assert set(bench.run(0.8)) == {Action.HOVER}
    assert bench.watchdog.explanation == "hovers: its telemetry is back, and has to last for 0.8 s"
    assert set(bench.run(60)[1:]) == {Action.FLY}


def test_a_shorter_pause_ends_with_its_first_packet(new_bench):
    bench = new_bench().fly()
    silent(bench, 0.4)
    assert bench.step().action is Action.FLY


def test_each_gap_begins_the_wait_anew(new_bench):
    bench = new_bench().fly()
    silent(bench, 1.2)
    for _ in range(3):
        assert set(bench.run(1.4)) == {Action.HOVER}
        silent(bench, 0.1)
    assert set(bench.run(1.52)) == {Action.HOVER}
    assert bench.step().action is Action.FLY


@pytest.mark.parametrize(("heard_s", "gone_s"), [(0.1, 1.9), (0.4, 1.6), (1.0, 1.0)])
def test_telemetry_for_a_part_of_the_time_lands_it(new_bench, heard_s, gone_s):
    bench, actions = new_bench().fly(), []
    for _ in range(12):
        actions += silent(bench, gone_s) + bench.run(heard_s)
    assert actions[-1] is Action.LAND
    late = actions[round(3.5 / 0.033) :]
    assert Action.FLY not in late


def test_gaps_that_go_on_after_a_long_silence_end_the_wait_and_then_the_flight(new_bench):
    bench, actions = new_bench().fly(), []
    silent(bench, 1.2)
    for _ in range(8):
        actions += bench.run(1.3) + silent(bench, 0.1)
    assert set(actions) == {Action.HOVER}
    assert bench.watchdog.failsafe == Condition.BACK_IN_DOUBT
    assert bench.watchdog.reason == "its telemetry is back, but with gaps for 10 s; RESUME is needed"
    assert bench.run(31)[-1] is Action.LAND, "nobody hovers for ever"


def test_after_a_shorter_silence_gaps_only_brake_it(new_bench):
    bench, actions = new_bench().fly(), []
    silent(bench, 0.6)
    for _ in range(40):
        actions += bench.run(0.7) + silent(bench, 0.1)
    assert bench.watchdog.mode is DriverMode.TRACK
    assert actions[40:].count(Action.FLY) > 0.8 * len(actions[40:])


def test_gaps_are_not_counted_as_long_silences(new_bench):
    bench = new_bench().fly()
    silent(bench, 2.0)
    for _ in range(3):
        bench.run(1.0)
        silent(bench, 0.1)
    assert bench.run(1.7)[-1] is Action.FLY


def test_an_order_to_go_on_ends_what_a_later_wrong_value_could_add_to(new_bench):
    bench = new_bench().fly()
    silent(bench, 2.0)
    bench.run(0.2)
    assert bench.order(Verb.RESUME).stage is AckStage.ACCEPTED
    assert bench.run(2)[-1] is Action.FLY
    bench.unsound = "its attitude jumped"
    assert bench.step().action is Action.HOVER
    bench.unsound = ""
    assert bench.step().action is Action.FLY


def test_a_pilot_who_flew_it_before_the_silence_keeps_it(new_bench):
    bench = new_bench().fly()
    bench.foreign = bench.piloted = True
    bench.run(3)
    silent(bench, 1.2)
    bench.run(40)
    assert bench.watchdog.mode is DriverMode.TRACK, "neither RESUME nor a landing takes it from the pilot"


def test_the_fourth_time_in_a_minute_it_waits_for_an_order_which_permits_three_more(new_bench):
    bench = new_bench().fly()
    for _ in range(2):
        for _ in range(3):
            silent(bench, 1.2)
            assert bench.run(12)[-1] is Action.FLY
        silent(bench, 1.2)
        waits(bench, Condition.BACK_IN_DOUBT)
        bench.run(8)


def test_only_silences_of_more_than_a_second_are_counted(new_bench):
    bench = new_bench().fly()
    for _ in range(12):
        silent(bench, 0.8)
        assert bench.run(5)[-1] is Action.FLY


def test_seldom_enough_it_goes_on_for_ever(new_bench):
    bench = new_bench().fly()
    for _ in range(12):
        silent(bench, 1.4)
        assert bench.run(19)[-1] is Action.FLY


@pytest.mark.parametrize("first", [True, False])
def test_wrong_values_in_a_silence_make_all_of_it_need_an_order(new_bench, first):
    bench = new_bench().fly()
    for wrong in (first, not first):
        bench.unsound, bench.fresh = ("its velocity is stuck at 0.00 m/s" if wrong else ""), wrong
        bench.run(0.7)
    bench.unsound, bench.fresh = "", True
    waits(bench, Condition.SENSORS_WRONG)


def freeze_tracker(bench, seconds):
    bench.tracker_speaks = False
    bench.run(seconds)
    bench.tracker_speaks = True


def freeze_supervisor(bench, seconds):
    bench.upstream = Upstream(supervisor_fresh=False)
    bench.run(seconds)
    bench.upstream = Upstream()


def freeze_driver(bench, seconds):
    bench.step(round(seconds * 1000) * MS)


FREEZES = {
    Condition.TRACKER_PAUSED: (freeze_tracker, 0.7),
    Condition.SUPERVISOR_SILENT: (freeze_supervisor, 1.2),
    Condition.DRIVER_STOOD: (freeze_driver, 0.7),
}


@pytest.mark.parametrize("in_silence", [True, False])
@pytest.mark.parametrize("failsafe", FREEZES)
def test_what_freezes_meanwhile_moves_nothing_when_it_returns(new_bench, failsafe, in_silence):
    freeze, seconds = FREEZES[failsafe]
    bench = new_bench().fly()
    bench.fresh = False
    bench.run(1.2)
    bench.fresh = not in_silence
    freeze(bench, seconds)
    bench.fresh = True
    assert set(bench.run(1.6)) == {Action.HOVER}
    assert (bench.watchdog.mode, bench.watchdog.failsafe) == (DriverMode.HOVER, failsafe)


def test_a_tracker_that_froze_meanwhile_still_lands_it(new_bench):
    bench = new_bench().fly()
    bench.fresh = bench.tracker_speaks = False
    bench.run(1.2)
    bench.fresh = bench.tracker_speaks = True
    assert Action.LAND not in bench.run(1.7)
    assert bench.run(0.2)[-1] is Action.LAND
    assert bench.watchdog.failsafe == Condition.NOT_RESUMED


def test_who_took_it_over_meanwhile_keeps_it(new_bench):
    bench = new_bench().fly()
    silent(bench, 2.0)
    bench.run(0.5)
    bench.foreign = True  # its heartbeat comes once a second
    assert set(bench.run(4)) == {Action.HOVER}
    assert bench.watchdog.reason == "its telemetry is back, but it is in a mode that is not ours; RESUME is needed"
    bench.foreign = False
    assert set(bench.run(4)) == {Action.HOVER}


def test_an_unsure_estimate_moves_nothing_after_it_either(new_bench):
    bench = new_bench().fly()
    bench.converged = False
    silent(bench, 1.2)
    assert set(bench.run(4)) == {Action.HOVER}
    bench.converged = True
    assert bench.step().action is Action.FLY


@pytest.mark.parametrize(("verb", "action"), [(Verb.HOLD, Action.HOVER), (Verb.LAND, Action.LAND)])
@pytest.mark.parametrize("heard", [True, False])
def test_a_stop_ordered_meanwhile_stands(new_bench, verb, action, heard):
    bench = new_bench().fly()
    bench.fresh = False
    bench.run(1.2)
    bench.fresh = heard
    bench.step()
    assert bench.order(verb).stage is AckStage.ACCEPTED
    bench.fresh = True
    assert set(bench.run(6)) == {action}


def test_an_order_to_go_on_ends_the_wait_at_once(new_bench):
    bench = new_bench().fly()
    silent(bench, 2.0)
    bench.step()
    assert bench.order(Verb.RESUME).stage is AckStage.ACCEPTED
    assert bench.step().action is Action.FLY


def test_a_new_take_off_begins_anew(new_bench):
    bench = new_bench().fly()
    for _ in range(3):
        silent(bench, 1.2)
        bench.run(8)
    bench.order(Verb.LAND)
    bench.step()
    bench.state, bench.tracker_speaks = FlightState.LANDED, False
    bench.run(2)
    bench.fly()
    silent(bench, 1.2)
    assert bench.run(1.7)[-1] is Action.FLY
