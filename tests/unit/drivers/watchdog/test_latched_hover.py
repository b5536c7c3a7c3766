"""A hover that only an order ends asks for one, is kept in its place where that is safe, and ends by itself."""

import pytest

from drivers.failsafe_table import Condition, Latch, Reaction, failsafes
from drivers.watchdog_types import Action, DriverMode, Upstream, WatchdogLimits
from groundstation.bus.messages import KEPT_IN_PLACE, AckStage, Verb

MS = 1_000_000


def stand_still(bench):
    bench.step(dt=700 * MS)


def report_nonsense(bench):
    bench.unsound = "its velocity is stuck at 0.00 m/s"
    bench.run(1.2)
    bench.unsound = ""


def lose_the_supervisor(bench):
    bench.upstream = Upstream(supervisor_fresh=False)
    bench.run(1.2)
    bench.upstream = Upstream()


def stray(bench):
    bench.stray = "1.0 m/s seen by cameras, 0.0 m/s asked"
    bench.step()
    bench.stray = ""


STOPS = {
    "this driver stood still for 0.7 s": stand_still,
    "its sensors cannot be believed: its velocity is stuck at 0.00 m/s": report_nonsense,
    "the supervisor does not answer": lose_the_supervisor,
    "it does not do what it is told: 1.0 m/s seen by cameras, 0.0 m/s asked": stray,
}


def stopped(bench, why):
    bench.fly()
    STOPS[why](bench)
    bench.step()
    assert (bench.watchdog.mode, bench.watchdog.reason) == (DriverMode.HOVER, f"{why}; RESUME is needed")
    return bench


@pytest.mark.parametrize("why", STOPS)
def test_it_says_when_it_lands_and_does_so_after_half_a_minute(new_bench, why):
    bench = stopped(new_bench(), why)
    assert set(bench.run(10)) == {Action.HOVER}
    assert bench.watchdog.explanation == f"{why}; RESUME is needed"
    left_s = bench.watchdog.lands_in_s
    assert left_s == pytest.approx(20.0, abs=0.3)
    assert Action.LAND not in bench.run(left_s - 0.2)
    assert bench.run(0.4)[-1] is Action.LAND
    assert bench.watchdog.reason == f"{why}, and nobody ordered RESUME"
    assert bench.watchdog.failsafe == Condition.LEFT_WAITING


@pytest.mark.parametrize("verb", [Verb.RESUME, Verb.TRACK, Verb.HOLD])
@pytest.mark.parametrize("why", STOPS)
def test_an_order_ends_the_wait(new_bench, why, verb):
    bench = stopped(new_bench(), why)
    bench.run(20)
    assert bench.order(verb).stage is AckStage.ACCEPTED
    assert set(bench.run(40)) == {Action.HOVER if verb is Verb.HOLD else Action.FLY}
    assert bench.watchdog.lands_in_s is None


def test_every_hover_that_waits_for_an_order_ends():
    """Whatever row led to it, one of the two waits begins, and both land."""
    table = failsafes(WatchdogLimits())
    latched = [row for row in table if row.latch is Latch.RESUME]
    assert latched and all(row.reaction is Reaction.HOVER for row in latched)
    ends = {row.condition for row in table if row.reaction is Reaction.LAND and DriverMode.HOVER in row.modes}
    assert {Condition.NOT_RESUMED, Condition.LEFT_WAITING} <= ends


def test_the_fault_itself_still_lands_it_sooner_and_is_named(new_bench):
    bench = new_bench().fly()
    bench.fresh = False
    bench.run(1.5)
    assert bench.watchdog.mode is DriverMode.TRACK and bench.watchdog.braked
    assert bench.watchdog.explanation == "hovers: no telemetry from the vehicle", "RESUME would be refused"
    assert bench.run(1.5)[-1] is Action.LAND


@pytest.mark.parametrize("why", STOPS)
def test_it_is_kept_in_its_place_unless_it_may_stray(new_bench, why):
    bench = stopped(new_bench(), why)
    bench.holds = True
    bench.run(0.2)
    kept = STOPS[why] is not stray
    assert (bench.decision.back_m_s is not None) is kept
    bench.fresh = False
    assert bench.step().back_m_s is None, "not while the fault lasts"


def test_a_tracker_that_paused_moves_nobody_by_itself(new_bench):
    bench = new_bench().fly()
    bench.tracker_speaks = False
    bench.run(0.7)
    bench.tracker_speaks = bench.holds = True
    bench.run(0.2)
    assert bench.watchdog.failsafe == Condition.TRACKER_PAUSED and bench.decision.back_m_s is None


def test_the_failsafes_after_which_it_is_kept_are_rows_of_the_table():
    suspending = {row.condition for row in failsafes(WatchdogLimits()) if row.latch is Latch.RESUME}
    assert KEPT_IN_PLACE - {""} < suspending


def test_one_that_strays_again_soon_after_it_was_stopped_for_that_lands(new_bench):
    bench = new_bench().fly()
    bench.stray = "1.4 m/s seen by cameras, 0.3 m/s asked"
    assert set(bench.run(1.0)) == {Action.HOVER}
    bench.stray = ""
    assert set(bench.run(1.5)) == {Action.HOVER}
    bench.stray = "1.3 m/s seen by cameras, 0.0 m/s asked"
    assert bench.step().action is Action.LAND
    assert bench.watchdog.failsafe == Condition.STRAYS_AGAIN
    assert bench.watchdog.reason == f"it does not do what it is told, again: {bench.stray}"


def test_one_that_swings_to_and_fro_on_hold_lands(new_bench):
    bench = new_bench().fly()
    bench.order(Verb.HOLD)
    for bench.stray, action in (("1.3 m/s", Action.HOVER), ("", Action.HOVER), ("1.3 m/s", Action.LAND)):
        assert bench.run(0.7)[-1] is action


def test_one_push_that_cameras_show_later_is_no_second_stray(new_bench):
    bench = new_bench().fly()
    bench.stray, bench.stray_by = "1.6 m/s reported, 0.3 m/s asked", "reported"
    assert set(bench.run(1.0)) == {Action.HOVER}
    bench.stray = bench.stray_by = ""
    assert set(bench.run(0.5)) == {Action.HOVER}
    bench.stray, bench.stray_by = "0.6 m/s seen by cameras, 0.0 m/s asked", "seen"
    assert set(bench.run(1.0)) == {Action.HOVER}


@pytest.mark.parametrize("ended", ["late", "resumed", "held", "stopped for something else"])
def test_one_that_strays_much_later_or_after_an_order_has_its_time(new_bench, ended):
    bench = new_bench().fly()
    if ended == "stopped for something else":
        stand_still(bench)
    else:
        stray(bench)
    bench.run(5.1 if ended == "late" else 1.0)
    if ended in ("resumed", "held"):
        assert bench.order(Verb.RESUME if ended == "resumed" else Verb.HOLD).stage is AckStage.ACCEPTED
        bench.run(0.1)
    bench.stray = "1.3 m/s seen by cameras, 0.0 m/s asked"
    assert set(bench.run(1.5)) == {Action.HOVER}
    assert bench.run(0.2)[-1] is Action.LAND and bench.watchdog.failsafe == Condition.STRAYS
