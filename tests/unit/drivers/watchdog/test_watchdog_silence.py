"""Effect of a silent tracker, vehicle or supervisor on a flying vehicle."""

import pytest

from drivers.watchdog_types import Action, Upstream
from groundstation.bus.messages import AckStage, FlightState, Header, VelocitySetpoint, Verb

MS = 1_000_000
S = 1_000_000_000


def test_lost_setpoints_hover_after_300_ms_and_land_after_3_s(new_bench):
    bench = new_bench().fly()
    bench.tracker_speaks = False
    began = bench.now
    times: dict[Action, float] = {}
    while bench.now - began < 5 * S:
        times.setdefault(bench.step().action, (bench.now - began) / S)
    assert times[Action.HOVER] == pytest.approx(0.3, abs=0.04)
    assert times[Action.LAND] == pytest.approx(3.0, abs=0.04)


def test_only_a_short_pause_of_the_tracker_is_forgiven(new_bench):
    bench = new_bench().fly()
    bench.tracker_speaks = False
    assert bench.run(0.4)[-1] is Action.HOVER
    bench.tracker_speaks = True
    assert bench.step().action is Action.FLY
    bench.tracker_speaks = False
    assert bench.run(0.7)[-1] is Action.HOVER
    bench.tracker_speaks = True
    assert set(bench.run(1)) == {Action.HOVER}, "moved by itself, as after a dead router came back"
    assert bench.order(Verb.RESUME).stage is AckStage.ACCEPTED
    assert set(bench.run(5)) == {Action.FLY}


@pytest.mark.parametrize("silent_s", [0.7, 2.0, 5.0])
def test_a_tracker_that_comes_back_unasked_does_not_stop_the_land_timer(new_bench, silent_s):
    bench = new_bench().fly()
    bench.tracker_speaks = False
    began, landed_s = bench.now, None
    while bench.now - began < 5 * S and landed_s is None:
        bench.tracker_speaks = bench.now - began > silent_s * S
        if bench.step().action is Action.LAND:
            landed_s = (bench.now - began) / S
    assert landed_s == pytest.approx(3.0, abs=0.04)


def test_an_operator_who_holds_after_a_pause_is_obeyed_for_as_long_as_setpoints_come(new_bench):
    bench = new_bench().fly()
    bench.tracker_speaks = False
    bench.run(0.7)
    bench.tracker_speaks = True
    assert bench.order(Verb.HOLD).stage is AckStage.ACCEPTED
    assert set(bench.run(6)) == {Action.HOVER}


@pytest.mark.parametrize("verb", [Verb.HOLD, None])
def test_a_silent_bus_lands_what_hovers_too(new_bench, verb):
    bench = new_bench().fly()
    if verb is not None:
        bench.order(verb)
    bench.tracker_speaks = bench.lease_alive = False
    assert Action.LAND not in bench.run(2.9)
    assert bench.run(0.2)[-1] is Action.LAND


@pytest.mark.parametrize("silent_s", [0.4, 1.0])
def test_an_order_to_track_gives_a_silent_tracker_time_to_speak(new_bench, silent_s):
    # 0.4 s: still in TRACK; 1.0 s: suspended.
    bench = new_bench().fly()
    bench.tracker_speaks = False
    bench.run(silent_s)
    assert bench.order(Verb.TRACK).stage is AckStage.ACCEPTED
    assert set(bench.run(0.3)) == {Action.HOVER}
    bench.tracker_speaks = True
    assert bench.step().action is Action.FLY


def test_landing_latches_whatever_is_sent(new_bench):
    bench = new_bench().fly()
    bench.tracker_speaks = False
    bench.run(3.2)
    bench.tracker_speaks = True
    for verb in (Verb.TRACK, Verb.RESUME, Verb.HOLD, Verb.TAKEOFF):
        assert bench.order(verb).stage is AckStage.REFUSED
    assert set(bench.run(2)) == {Action.LAND}


def test_a_new_epoch_moves_nothing_until_resume(new_bench):
    bench = new_bench().fly()
    bench.epoch = 2
    actions = bench.run(1)
    assert actions[-1] is Action.HOVER
    assert "RESUME" in bench.order(Verb.TRACK).reason
    bench.converged = False
    bench.step()
    assert "converged" in bench.order(Verb.RESUME).reason
    bench.converged = True
    bench.step()
    assert bench.order(Verb.RESUME).stage is AckStage.ACCEPTED
    assert bench.step().action is Action.FLY
    assert bench.setpoint(epoch=1, seq=10**6) == "old_epoch"


def test_a_new_epoch_does_not_stop_the_land_timer(new_bench):
    bench = new_bench().fly()
    bench.epoch = 2
    actions = bench.run(3.2)
    assert Action.FLY not in actions and actions[-1] is Action.LAND


def test_a_belief_that_is_not_converged_hovers_but_is_no_silence(new_bench):
    bench = new_bench().fly()
    bench.converged = False
    assert set(bench.run(5)) == {Action.HOVER}
    bench.converged = True
    assert bench.step().action is Action.FLY


def test_setpoints_expire_by_receipt_and_by_stamp(new_bench):
    bench = new_bench().fly()
    bench.tracker_speaks = False
    bench.run(0.5)
    assert bench.setpoint(stamp=bench.now - 400 * MS) == "expired"
    assert bench.setpoint(lifetime=0) == "expired"
    assert bench.setpoint(stamp=bench.now + 10 * S, lifetime=10_000) == ""
    assert bench.run(0.26)[-1] is Action.FLY
    assert bench.run(0.1)[-1] is Action.HOVER, "a stamp of the future, or a long lifetime, buys nothing"
    assert bench.setpoint(stamp=0, clock="elsewhere") == "", "another host's stamp says nothing here"


def test_replayed_setpoints_are_ignored(new_bench):
    bench = new_bench().fly()
    assert bench.setpoint(seq=0) == "old_sequence"
    number = next(bench.numbers)
    assert bench.setpoint(seq=number) == ""
    assert bench.setpoint(seq=number) == "old_sequence"


def test_nobody_else_speaks_for_the_epoch_of_a_tracker(new_bench):
    bench = new_bench().fly()
    forged = VelocitySetpoint(
        header=Header(bench.now, "clock", "drone_1", "stranger", 10**9),
        velocity_m_s=(2.0, 0.0, 0.0),
        yaw_rate_rad_s=0.0,
        lifetime_ms=300,
        epoch=bench.epoch,
    )
    assert bench.watchdog.accept_setpoint(bench.now, forged) == "other_source"
    assert bench.setpoint() == "", "its number does not make the true ones old"


def test_an_unseen_drone_lands_after_10_s(new_bench):
    bench = new_bench()
    bench.order(Verb.TAKEOFF)
    bench.step()
    bench.state = FlightState.HOVERING
    assert set(bench.run(9.9)) == {Action.HOVER}
    assert bench.run(0.3)[-1] is Action.LAND


@pytest.mark.parametrize("mode", [Verb.TRACK, Verb.HOLD])
def test_low_battery_lands_after_3_s(new_bench, mode):
    bench = new_bench().fly()
    bench.order(mode)
    bench.battery = 0.1
    assert Action.LAND not in bench.run(2.9)
    bench.battery = 0.2
    bench.run(15.0)
    bench.battery = 0.1
    assert Action.LAND not in bench.run(2.9)
    assert bench.run(0.3)[-1] is Action.LAND


def test_a_dead_supervisor_hovers_then_lands(new_bench):
    bench = new_bench().fly()
    bench.upstream = Upstream(supervisor_alive=False)
    assert bench.step().action is Action.HOVER
    assert bench.run(1.1)[-1] is Action.LAND


def test_a_frozen_supervisor_hovers_then_lands_and_only_a_short_one_is_forgiven(new_bench):
    bench = new_bench().fly()
    bench.upstream = Upstream(supervisor_fresh=False)
    assert set(bench.run(0.5)) == {Action.HOVER}
    bench.upstream = Upstream()
    assert bench.step().action is Action.FLY
    bench.upstream = Upstream(supervisor_fresh=False)
    bench.run(1.2)
    bench.upstream = Upstream()
    assert set(bench.run(2)) == {Action.HOVER}
    assert bench.order(Verb.RESUME).stage is AckStage.ACCEPTED
    assert bench.step().action is Action.FLY
    bench.upstream = Upstream(supervisor_fresh=False)
    assert bench.run(3.2)[-1] is Action.LAND


def test_sigterm_lands_at_once(new_bench):
    bench = new_bench().fly()
    bench.upstream = Upstream(stop_requested=True)
    assert bench.step().action is Action.LAND


def test_silent_telemetry_hovers_and_lands_and_an_order_shortens_the_wait_after_it(new_bench):
    bench = new_bench().fly()
    bench.fresh = False
    assert set(bench.run(1.2)) == {Action.HOVER}
    bench.fresh = True
    assert set(bench.run(1)) == {Action.HOVER}
    bench.order(Verb.RESUME)
    assert bench.step().action is Action.FLY
    bench.fresh = False
    assert bench.run(3.2)[-1] is Action.LAND


@pytest.mark.parametrize("lifetime_s", [0.1, 1.0])
def test_the_life_of_setpoints_does_not_shorten_the_patience_with_other_silences(new_bench, lifetime_s):
    frozen = Upstream(supervisor_fresh=False)
    for name, value in (("fresh", False), ("upstream", frozen), ("state", FlightState.UNKNOWN)):
        bench = new_bench(hover_after_s=lifetime_s, land_after_s=1.1).fly()
        setattr(bench, name, value)
        # It is noticed 0.3 s after it began.
        assert Action.LAND not in bench.run(0.75)
        assert bench.run(0.1)[-1] is Action.LAND


def test_hold_in_a_take_off_does_not_trust_what_was_heard_before_a_silence(new_bench):
    bench = new_bench()
    bench.order(Verb.TAKEOFF)
    bench.step()
    bench.fresh = False  # the take-off began, and nobody hears of it
    bench.run(0.5)
    assert bench.order(Verb.HOLD).stage is AckStage.ACCEPTED
    assert bench.step().action is Action.HOVER
    assert bench.run(3.0)[-1] is Action.LAND


def test_a_driver_that_was_frozen_does_not_move_by_itself(new_bench):
    bench = new_bench().fly()
    assert bench.step(dt=700 * MS).action is Action.HOVER
    assert set(bench.run(2)) == {Action.HOVER}
    bench.order(Verb.TRACK)
    assert bench.step().action is Action.FLY
