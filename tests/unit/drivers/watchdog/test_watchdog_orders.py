"""Rights and effects of commands: the authority rules one by one."""

import pytest

from drivers.watchdog import Watchdog
from drivers.watchdog_types import Action, DriverMode, Upstream, VehicleView, WatchdogLimits
from groundstation.bus.messages import AckStage, FlightState, Lease, Verb

MS = 1_000_000
S = 1_000_000_000


def test_take_off_track_and_land(new_bench):
    bench = new_bench()
    assert bench.decision.action is Action.IDLE
    assert bench.order(Verb.TAKEOFF, id="up").stage is AckStage.ACCEPTED
    assert bench.step().action is Action.TAKE_OFF
    bench.state = FlightState.TAKING_OFF
    assert bench.step().acks == ()
    bench.state = FlightState.HOVERING
    decision = bench.step()
    assert (decision.mode, decision.action) == (DriverMode.HOVER, Action.HOVER)
    assert [(ack.command_id, ack.stage) for ack in decision.acks] == [("up", AckStage.EFFECTIVE)]
    bench.tracker_speaks = True
    assert bench.step().action is Action.HOVER, "setpoints move nothing before TRACK"
    assert bench.order(Verb.TRACK, id="track").stage is AckStage.ACCEPTED
    decision = bench.step()
    assert (decision.action, decision.velocity_m_s, decision.yaw_rate_rad_s) == (Action.FLY, (0.3, 0.0, 0.0), 0.1)
    assert [ack.command_id for ack in decision.acks] == ["track"]
    assert bench.order(Verb.LAND, issuer="anyone", id="down").stage is AckStage.ACCEPTED
    assert bench.step().action is Action.LAND
    bench.state = FlightState.LANDED
    decision = bench.step()
    assert (decision.mode, decision.acks[0].command_id) == (DriverMode.LANDED, "down")
    assert set(bench.run(1)) == {Action.LAND, Action.IDLE}, "told for a second, though it says that it stands"
    assert set(bench.run(5)) == {Action.IDLE}, "setpoints go on and move nothing"


def test_a_vehicle_that_says_in_flight_that_it_has_landed_is_told_to_land(new_bench):
    """Its report may be wrong, and nobody else would end its flight."""
    bench = new_bench().fly()
    bench.state = FlightState.LANDED
    decision = bench.step()
    assert (decision.mode, decision.action) == (DriverMode.LANDED, Action.LAND)
    assert bench.run(2)[-1] is Action.IDLE
    assert bench.order(Verb.LAND, issuer="anyone").stage is AckStage.ACCEPTED
    assert bench.step().action is Action.LAND, "an order to land is told once more"
    assert bench.run(2)[-1] is Action.IDLE


@pytest.mark.parametrize(
    "state", [FlightState.FLYING, FlightState.HOVERING, FlightState.TAKING_OFF, FlightState.LANDING]
)
def test_a_restarted_driver_brakes_and_lands_what_flies(new_bench, state):
    bench = new_bench(state=state)
    assert bench.decision.action is Action.HOVER
    bench.tracker_speaks = True
    bench.run(0.5)
    assert bench.order(Verb.TRACK).stage is AckStage.REFUSED
    assert bench.run(0.7)[-1] is Action.LAND


@pytest.mark.parametrize(("braked_s", "lands_s"), [(0.4, 0.6), (1.0, 0.0), (2.5, 0.0)])
def test_a_restarted_driver_lands_the_sooner_the_longer_others_braked(braked_s, lands_s):
    dog = Watchdog(WatchdogLimits(), "clock", braked_ns=round(braked_s * S))
    steps = [n * 33 * MS for n in range(1, 40)]
    view = VehicleView(FlightState.FLYING, True, 0.9, "")
    landing = [at for at in steps if dog.step(at, view, Upstream()).action is Action.LAND]
    assert lands_s <= (landing[0] - steps[0]) / S < lands_s + 0.07


def test_a_braked_vehicle_lands_once_braking_is_over():
    dog, view = Watchdog(WatchdogLimits(), "clock", braked_ns=400 * MS), VehicleView(FlightState.FLYING, True, 0.9, "")
    told = [dog.step(at, view, Upstream()).action for at in (S, S + 600 * MS - 1, S + 600 * MS)]
    assert told == [Action.HOVER, Action.HOVER, Action.LAND]


def test_before_the_vehicle_was_heard_nothing_is_decided(new_bench):
    bench = new_bench(state=FlightState.UNKNOWN)
    bench.fresh = False
    assert set(bench.run(3)) == {Action.WAIT}
    assert bench.order(Verb.TAKEOFF).stage is AckStage.REFUSED
    bench.state, bench.fresh = FlightState.LANDED, True
    assert set(bench.run(1)) == {Action.IDLE}


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"fresh": False}, "telemetry"),
        ({"battery": 0.1}, "battery 10%"),
        ({"battery": None}, "battery unknown"),
        ({"not_ready": "configuring"}, "configuring"),
        ({"upstream": Upstream(supervisor_fresh=False)}, "supervisor"),
        ({"upstream": Upstream(stop_requested=True)}, "stopping"),
        ({"upstream": Upstream(supervisor_alive=False)}, "stopping"),
    ],
)
def test_take_off_is_refused_with_the_reason(new_bench, change, reason):
    bench = new_bench()
    for name, value in change.items():
        setattr(bench, name, value)
    bench.step()
    ack = bench.order(Verb.TAKEOFF)
    assert ack.stage is AckStage.REFUSED and reason in ack.reason
    assert bench.step().action is Action.IDLE


def test_starting_orders_need_the_lease_and_stops_do_not(new_bench):
    bench = new_bench().fly()
    assert "held by op" in bench.order(Verb.TRACK, issuer="thief").reason
    assert bench.order(Verb.TRACK, expires=bench.now - 1).reason == "expired"
    assert "clock" in bench.order(Verb.TRACK, clock="elsewhere").reason
    bench.lease_alive = False
    bench.run(2.5)
    assert bench.order(Verb.RESUME).reason == "no live operator lease"
    assert bench.order(Verb.HOLD, issuer="anyone", expires=1).stage is AckStage.ACCEPTED
    assert bench.order(Verb.LAND, issuer="anyone", expires=1).stage is AckStage.ACCEPTED
    assert bench.order(Verb.CUT_MOTORS, issuer="anyone", expires=1).stage is AckStage.ACCEPTED


def test_a_live_lease_is_not_taken_over_nor_replayed(new_bench):
    bench = new_bench()
    accept = bench.watchdog.accept_lease
    bench.lease_alive = False
    bench.now += MS
    theft = Lease(header=bench.header(), holder="thief", expires_ns=bench.now + 2 * S)
    assert accept(bench.now, theft) == "held"
    replay = Lease(header=bench.header(bench.now - S), holder="op", expires_ns=bench.now + 2 * S)
    assert accept(bench.now, replay) == "old"
    foreign = Lease(header=bench.header(clock="elsewhere"), holder="op", expires_ns=bench.now + 2 * S)
    assert accept(bench.now, foreign) == "other_clock"
    prophecy = Lease(header=bench.header(bench.now + 3600 * S), holder="op", expires_ns=bench.now + 2 * S)
    assert accept(bench.now, prophecy) == "future", "it would make every true lease look old"
    eternal = Lease(header=bench.header(), holder="op", expires_ns=bench.now + 3600 * S)
    assert accept(bench.now, eternal) == ""
    bench.now += 6 * S
    assert bench.order(Verb.TAKEOFF).reason == "no live operator lease"
    assert accept(bench.now, Lease(header=bench.header(), holder="next", expires_ns=bench.now + S)) == ""


def test_a_repeated_command_is_answered_but_not_obeyed_again(new_bench):
    bench = new_bench().fly()
    assert bench.order(Verb.LAND, id="down").stage is AckStage.ACCEPTED
    bench.state = FlightState.LANDED
    bench.step()
    bench.state = FlightState.LANDED
    bench.tracker_speaks = False
    assert bench.order(Verb.TAKEOFF).stage is AckStage.ACCEPTED
    assert bench.order(Verb.LAND, id="down").stage is AckStage.EFFECTIVE
    assert bench.step().action is Action.TAKE_OFF


def test_hold_waits_for_resume(new_bench):
    bench = new_bench().fly()
    bench.state = FlightState.FLYING
    assert bench.order(Verb.HOLD, issuer="anyone", id="hold").stage is AckStage.ACCEPTED
    decision = bench.step()
    assert (decision.action, decision.acks) == (Action.HOVER, ())
    bench.state = FlightState.HOVERING
    assert [ack.command_id for ack in bench.step().acks] == ["hold"]
    assert set(bench.run(5)) == {Action.HOVER}
    bench.order(Verb.RESUME)
    assert bench.step().action is Action.FLY


@pytest.mark.parametrize("state", [FlightState.LANDED, FlightState.EMERGENCY])
def test_hold_cancels_a_take_off_that_has_not_begun(new_bench, state):
    bench = new_bench(state=state)
    bench.order(Verb.TAKEOFF)
    bench.step()
    bench.order(Verb.HOLD)
    assert bench.step().action is Action.IDLE
    bench.state = FlightState.LANDED
    assert bench.step().action is Action.IDLE, "a drone whose emergency has just been cleared stays down"


@pytest.mark.parametrize("state", [FlightState.TAKING_OFF, FlightState.UNKNOWN, FlightState.FLYING])
def test_hold_in_the_climb_holds_for_as_long_as_a_take_off_lets_it_hover_unseen(new_bench, state):
    bench = new_bench()
    bench.order(Verb.TAKEOFF)
    bench.step()
    bench.state = state
    bench.see()
    assert bench.order(Verb.HOLD).stage is AckStage.ACCEPTED
    decision = bench.step()
    assert (decision.mode, decision.action, decision.reason) == (DriverMode.HOLD, Action.HOVER, "held by op")
    bench.state = FlightState.HOVERING
    assert set(bench.run(9.8)) == {Action.HOVER}, "the tracker was not heard yet"
    assert bench.run(0.3)[-1] is Action.LAND


@pytest.mark.parametrize("verb", [Verb.HOLD, Verb.LAND])
def test_a_drone_that_starts_after_its_take_off_was_cancelled_is_landed_for_that_reason(new_bench, verb):
    bench = new_bench()
    bench.order(Verb.TAKEOFF)
    bench.step()
    bench.order(verb, issuer="anyone")
    bench.step()
    bench.state = FlightState.TAKING_OFF  # the start command was on its way
    decision = bench.step()
    assert decision.action is Action.LAND
    assert "without a standing take-off order" in decision.reason and "anyone" in decision.reason


def test_take_off_that_takes_too_long_is_given_up(new_bench):
    bench = new_bench(take_off_s=2.0)
    bench.order(Verb.TAKEOFF)
    bench.state = FlightState.TAKING_OFF
    assert bench.run(2.2)[-1] is Action.LAND


def test_cut_beats_all_and_latches(new_bench):
    bench = new_bench().fly()
    bench.order(Verb.LAND)
    bench.step()
    bench.order(Verb.CUT_MOTORS, issuer="anyone", id="cut")
    assert bench.step().action is Action.CUT
    for verb in (Verb.HOLD, Verb.TRACK, Verb.RESUME, Verb.TAKEOFF):
        assert bench.order(verb).stage is AckStage.REFUSED
    assert set(bench.run(1)) == {Action.CUT}
    bench.state = FlightState.EMERGENCY
    assert [ack.command_id for ack in bench.step().acks] == ["cut"]
    assert bench.order(Verb.LAND).reason == "motors are cut"
    assert set(bench.run(3)) == {Action.CUT}


def test_a_new_take_off_clears_an_emergency(new_bench):
    bench = new_bench()
    bench.order(Verb.CUT_MOTORS)
    bench.state = FlightState.EMERGENCY
    bench.step()
    assert bench.order(Verb.TAKEOFF).stage is AckStage.ACCEPTED
    assert bench.step().action is Action.TAKE_OFF
    bench.state = FlightState.LANDED
    assert bench.step().action is Action.TAKE_OFF
    bench.state = FlightState.EMERGENCY
    assert bench.step().action is Action.CUT, "a second emergency is not cleared by the same order"


def test_clearing_and_starting_are_two_orders_where_the_vehicle_can_tell_them_apart(new_bench):
    bench = new_bench(state=FlightState.EMERGENCY, clears=True)
    first = bench.order(Verb.TAKEOFF)
    assert first.stage is AckStage.REFUSED and first.final and "order TAKEOFF again" in first.reason
    assert bench.step().action is Action.CLEAR
    bench.state = FlightState.LANDED
    assert set(bench.run(3)) == {Action.IDLE}, "nothing starts by itself"
    assert bench.order(Verb.TAKEOFF).stage is AckStage.ACCEPTED
    assert bench.step().action is Action.TAKE_OFF
    bench.state = FlightState.EMERGENCY
    assert bench.step().action is Action.CUT


def test_an_emergency_whose_cause_stays_is_pressed_for_two_seconds_only(new_bench):
    bench = new_bench(state=FlightState.EMERGENCY, clears=True)
    bench.order(Verb.TAKEOFF)
    assert set(bench.run(1.9)) == {Action.CLEAR}
    assert bench.run(0.3)[-1] is Action.IDLE
    assert bench.order(Verb.TAKEOFF).stage is AckStage.REFUSED
    assert bench.step().action is Action.CLEAR


def test_an_emergency_that_does_not_clear_ends_the_take_off(new_bench):
    bench = new_bench(state=FlightState.EMERGENCY)
    bench.order(Verb.TAKEOFF)
    assert bench.run(1.9)[-1] is Action.TAKE_OFF
    assert bench.run(0.3)[-1] is Action.CUT


def test_an_emergency_in_flight_is_no_landing(new_bench):
    bench = new_bench().fly()
    bench.state = FlightState.EMERGENCY
    assert bench.step().mode is DriverMode.CUT


def test_a_vehicle_that_lands_by_itself_is_not_taken_up_again(new_bench):
    bench = new_bench().fly()
    bench.state = FlightState.LANDING
    assert bench.step().action is Action.LAND
    bench.state = FlightState.HOVERING
    assert bench.step().action is Action.LAND


@pytest.mark.parametrize("state", [FlightState.LANDED, FlightState.LANDING, FlightState.EMERGENCY])
@pytest.mark.parametrize("verb", [Verb.TRACK, Verb.RESUME])
def test_a_vehicle_that_has_just_ended_its_flight_is_not_tracked_with(new_bench, verb, state):
    bench = new_bench().fly()
    bench.state = state
    bench.see()
    ack = bench.order(verb)
    assert (ack.stage, ack.reason) == (AckStage.REFUSED, f"the vehicle says {state}")


def test_a_vehicle_that_flies_without_order_is_landed(new_bench):
    bench = new_bench()
    bench.state = FlightState.FLYING
    assert bench.step().action is Action.LAND


def test_a_watchdog_begins_knowing_nothing_and_by_no_failsafe():
    watchdog = Watchdog(WatchdogLimits(), "clock")
    assert (watchdog.failsafe, watchdog.vehicle, watchdog.upstream) == ("", VehicleView(), Upstream())
    decision = watchdog.step(S, VehicleView(), Upstream())
    assert (decision.action, decision.entered_ns) == (Action.WAIT, 0)


@pytest.mark.parametrize(("state", "then"), [(FlightState.UNKNOWN, Action.WAIT), (FlightState.LANDED, Action.IDLE)])
def test_one_that_is_not_in_the_air_as_far_as_is_known_is_told_to_land_for_a_second(new_bench, state, then):
    bench = new_bench(state)
    bench.order(Verb.LAND, issuer="anyone")
    assert bench.step(S - 1).action is Action.LAND
    assert bench.step(1).action is then
