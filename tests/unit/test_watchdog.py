"""The authority rules, one by one: who may move a vehicle, and what silence does to it."""

import itertools

import pytest

from drivers.authority import Action, AuthorityLimits, Mode, Upstream, VehicleView
from drivers.watchdog import Watchdog
from groundstation.bus.messages import AckStage, Command, FlightState, Header, Lease, VelocitySetpoint, Verb

MS = 1_000_000
S = 1_000_000_000
STEP = 33 * MS


class Bench:
    """A watchdog with a vehicle that obeys, driven step by step under a clock of our own."""

    def __init__(self, state=FlightState.LANDED, **limits):
        self.watchdog = Watchdog(AuthorityLimits(**limits), "clock")
        self.now = 100 * S
        self.state = state
        self.fresh = True
        self.battery = 0.9
        self.not_ready = ""
        self.upstream = Upstream()
        self.epoch = 1
        self.ids = itertools.count()
        self.numbers = itertools.count()
        self.tracker_speaks = False
        self.converged = True
        self.lease_alive = True
        self.decision = self.step()

    def header(self, stamp=None, seq=0, clock="clock"):
        return Header(self.now if stamp is None else stamp, clock, "drone_1", "tester", seq)

    def step(self, dt=STEP):
        self.now += dt
        if self.lease_alive:
            self.watchdog.accept_lease(self.now, Lease(header=self.header(), holder="op", expires_ns=self.now + 2 * S))
        if self.tracker_speaks:
            self.setpoint()
        view = VehicleView(self.state, self.fresh, self.battery, self.not_ready)
        self.decision = self.watchdog.step(self.now, view, self.upstream)
        return self.decision

    def run(self, seconds):
        decisions = [self.step() for _ in range(round(seconds * S / STEP))]
        return [decision.action for decision in decisions]

    def setpoint(self, velocity=(0.3, 0.0, 0.0), **changes):
        fields = {"seq": next(self.numbers), "epoch": self.epoch, "lifetime": 300, "stamp": self.now, "clock": "clock"}
        fields |= changes
        message = VelocitySetpoint(
            header=self.header(fields["stamp"], fields["seq"], fields["clock"]),
            velocity_m_s=velocity,
            yaw_rate_rad_s=0.1,
            lifetime_ms=fields["lifetime"],
            epoch=fields["epoch"],
            converged=self.converged,
        )
        return self.watchdog.accept_setpoint(self.now, message)

    def order(self, verb, issuer="op", expires=None, id=None, clock="clock"):
        stopping = verb in (Verb.HOLD, Verb.LAND, Verb.CUT_MOTORS)
        expires_ns = expires if expires is not None else (0 if stopping else self.now + 5 * S)
        command = Command(
            header=self.header(clock=clock),
            id=id or f"c{next(self.ids)}",
            verb=verb,
            scope=(),
            issuer=issuer,
            expires_ns=expires_ns,
        )
        return self.watchdog.accept_command(self.now, command)[-1]

    def fly(self):
        """Take off and track."""
        assert self.order(Verb.TAKEOFF).stage is AckStage.ACCEPTED
        self.state = FlightState.TAKING_OFF
        self.step()
        self.state = FlightState.HOVERING
        self.tracker_speaks = True
        self.step()
        assert self.order(Verb.TRACK).stage is AckStage.ACCEPTED
        assert self.step().action is Action.FLY
        return self


def test_take_off_track_and_land():
    bench = Bench()
    assert bench.decision.action is Action.IDLE
    assert bench.order(Verb.TAKEOFF, id="up").stage is AckStage.ACCEPTED
    assert bench.step().action is Action.TAKE_OFF
    bench.state = FlightState.TAKING_OFF
    assert bench.step().acks == ()
    bench.state = FlightState.HOVERING
    decision = bench.step()
    assert (decision.mode, decision.action) == (Mode.HOVER, Action.HOVER)
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
    assert (decision.mode, decision.action, decision.acks[0].command_id) == (Mode.LANDED, Action.IDLE, "down")
    assert set(bench.run(5)) == {Action.IDLE}, "setpoints go on and move nothing"


def test_lost_setpoints_hover_after_300_ms_and_land_after_3_s():
    bench = Bench().fly()
    bench.tracker_speaks = False
    began = bench.now
    times = {}
    while bench.now - began < 5 * S:
        times.setdefault(bench.step().action, (bench.now - began) / S)
    assert times[Action.HOVER] == pytest.approx(0.3, abs=0.04)
    assert times[Action.LAND] == pytest.approx(3.0, abs=0.04)


def test_the_same_epoch_may_resume_before_the_landing():
    bench = Bench().fly()
    bench.tracker_speaks = False
    assert bench.run(2.5)[-1] is Action.HOVER
    bench.tracker_speaks = True
    assert bench.step().action is Action.FLY


def test_landing_latches_whatever_is_sent():
    bench = Bench().fly()
    bench.tracker_speaks = False
    bench.run(3.2)
    bench.tracker_speaks = True
    for verb in (Verb.TRACK, Verb.RESUME, Verb.HOLD, Verb.TAKEOFF):
        assert bench.order(verb).stage is AckStage.REFUSED
    assert set(bench.run(2)) == {Action.LAND}


def test_a_new_epoch_moves_nothing_until_resume():
    bench = Bench().fly()
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


def test_a_new_epoch_does_not_stop_the_land_timer():
    bench = Bench().fly()
    bench.epoch = 2
    actions = bench.run(3.2)
    assert Action.FLY not in actions and actions[-1] is Action.LAND


def test_a_belief_that_is_not_converged_hovers_but_is_no_silence():
    bench = Bench().fly()
    bench.converged = False
    assert set(bench.run(5)) == {Action.HOVER}
    bench.converged = True
    assert bench.step().action is Action.FLY


def test_setpoints_expire_by_receipt_and_by_stamp():
    bench = Bench().fly()
    bench.tracker_speaks = False
    bench.run(0.5)
    assert bench.setpoint(stamp=bench.now - 400 * MS) == "expired"
    assert bench.setpoint(lifetime=0) == "expired"
    assert bench.setpoint(stamp=bench.now + 10 * S, lifetime=10_000) == ""
    assert bench.run(0.26)[-1] is Action.FLY
    assert bench.run(0.1)[-1] is Action.HOVER, "a stamp of the future, or a long lifetime, buys nothing"
    assert bench.setpoint(stamp=0, clock="elsewhere") == "", "another host's stamp says nothing here"


def test_replayed_setpoints_are_ignored():
    bench = Bench().fly()
    assert bench.setpoint(seq=0) == "old_sequence"
    number = next(bench.numbers)
    assert bench.setpoint(seq=number) == ""
    assert bench.setpoint(seq=number) == "old_sequence"


def test_an_unseen_drone_lands_after_10_s():
    bench = Bench()
    bench.order(Verb.TAKEOFF)
    bench.step()
    bench.state = FlightState.HOVERING
    assert set(bench.run(9.9)) == {Action.HOVER}
    assert bench.run(0.3)[-1] is Action.LAND


@pytest.mark.parametrize("mode", [Verb.TRACK, Verb.HOLD])
def test_low_battery_lands_after_3_s(mode):
    bench = Bench().fly()
    bench.order(mode)
    bench.battery = 0.1
    assert Action.LAND not in bench.run(2.9)
    bench.battery = 0.2
    bench.step()
    bench.battery = 0.1
    assert Action.LAND not in bench.run(2.9)
    assert bench.run(0.3)[-1] is Action.LAND


def test_a_dead_supervisor_hovers_then_lands():
    bench = Bench().fly()
    bench.upstream = Upstream(supervisor_alive=False)
    assert bench.step().action is Action.HOVER
    assert bench.run(1.1)[-1] is Action.LAND


def test_a_frozen_supervisor_hovers_then_lands_and_only_a_short_one_is_forgiven():
    bench = Bench().fly()
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


def test_sigterm_lands_at_once():
    bench = Bench().fly()
    bench.upstream = Upstream(stop_requested=True)
    assert bench.step().action is Action.LAND


def test_silent_telemetry_hovers_needs_resume_and_lands():
    bench = Bench().fly()
    bench.fresh = False
    assert set(bench.run(1.2)) == {Action.HOVER}
    bench.fresh = True
    assert set(bench.run(1)) == {Action.HOVER}
    bench.order(Verb.RESUME)
    assert bench.step().action is Action.FLY
    bench.fresh = False
    assert bench.run(3.2)[-1] is Action.LAND


def test_a_driver_that_was_frozen_does_not_move_by_itself():
    bench = Bench().fly()
    assert bench.step(dt=700 * MS).action is Action.HOVER
    assert set(bench.run(2)) == {Action.HOVER}
    bench.order(Verb.TRACK)
    assert bench.step().action is Action.FLY


@pytest.mark.parametrize(
    "state", [FlightState.FLYING, FlightState.HOVERING, FlightState.TAKING_OFF, FlightState.LANDING]
)
def test_a_restarted_driver_brakes_and_lands_what_flies(state):
    bench = Bench(state=state)
    assert bench.decision.action is Action.HOVER
    bench.tracker_speaks = True
    bench.run(0.5)
    assert bench.order(Verb.TRACK).stage is AckStage.REFUSED
    assert bench.run(0.7)[-1] is Action.LAND


def test_before_the_vehicle_was_heard_nothing_is_decided():
    bench = Bench(state=FlightState.UNKNOWN)
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
def test_take_off_is_refused_with_the_reason(change, reason):
    bench = Bench()
    for name, value in change.items():
        setattr(bench, name, value)
    bench.step()
    ack = bench.order(Verb.TAKEOFF)
    assert ack.stage is AckStage.REFUSED and reason in ack.reason
    assert bench.step().action is Action.IDLE


def test_starting_orders_need_the_lease_and_stops_do_not():
    bench = Bench().fly()
    assert "held by op" in bench.order(Verb.TRACK, issuer="thief").reason
    assert bench.order(Verb.TRACK, expires=bench.now - 1).reason == "expired"
    assert "clock" in bench.order(Verb.TRACK, clock="elsewhere").reason
    bench.lease_alive = False
    bench.run(2.5)
    assert bench.order(Verb.RESUME).reason == "no live operator lease"
    assert bench.order(Verb.HOLD, issuer="anyone", expires=1).stage is AckStage.ACCEPTED
    assert bench.order(Verb.LAND, issuer="anyone", expires=1).stage is AckStage.ACCEPTED
    assert bench.order(Verb.CUT_MOTORS, issuer="anyone", expires=1).stage is AckStage.ACCEPTED


def test_a_live_lease_is_not_taken_over_nor_replayed():
    bench = Bench()
    accept = bench.watchdog.accept_lease
    bench.lease_alive = False
    bench.now += MS
    theft = Lease(header=bench.header(), holder="thief", expires_ns=bench.now + 2 * S)
    assert accept(bench.now, theft) == "held"
    replay = Lease(header=bench.header(bench.now - S), holder="op", expires_ns=bench.now + 2 * S)
    assert accept(bench.now, replay) == "old"
    foreign = Lease(header=bench.header(clock="elsewhere"), holder="op", expires_ns=bench.now + 2 * S)
    assert accept(bench.now, foreign) == "other_clock"
    eternal = Lease(header=bench.header(), holder="op", expires_ns=bench.now + 3600 * S)
    assert accept(bench.now, eternal) == ""
    bench.now += 6 * S
    assert bench.order(Verb.TAKEOFF).reason == "no live operator lease"
    assert accept(bench.now, Lease(header=bench.header(), holder="next", expires_ns=bench.now + S)) == ""


def test_a_repeated_command_is_answered_but_not_obeyed_again():
    bench = Bench().fly()
    assert bench.order(Verb.LAND, id="down").stage is AckStage.ACCEPTED
    bench.state = FlightState.LANDED
    bench.step()
    bench.state = FlightState.LANDED
    bench.tracker_speaks = False
    assert bench.order(Verb.TAKEOFF).stage is AckStage.ACCEPTED
    assert bench.order(Verb.LAND, id="down").stage is AckStage.EFFECTIVE
    assert bench.step().action is Action.TAKE_OFF


def test_hold_waits_for_resume():
    bench = Bench().fly()
    bench.state = FlightState.FLYING
    assert bench.order(Verb.HOLD, issuer="anyone", id="hold").stage is AckStage.ACCEPTED
    decision = bench.step()
    assert (decision.action, decision.acks) == (Action.HOVER, ())
    bench.state = FlightState.HOVERING
    assert [ack.command_id for ack in bench.step().acks] == ["hold"]
    assert set(bench.run(5)) == {Action.HOVER}
    bench.order(Verb.RESUME)
    assert bench.step().action is Action.FLY


def test_hold_cancels_a_take_off_that_has_not_begun():
    bench = Bench()
    bench.order(Verb.TAKEOFF)
    bench.step()
    bench.order(Verb.HOLD)
    assert bench.step().action is Action.IDLE


def test_take_off_that_takes_too_long_is_given_up():
    bench = Bench(take_off_s=2.0)
    bench.order(Verb.TAKEOFF)
    bench.state = FlightState.TAKING_OFF
    assert bench.run(2.2)[-1] is Action.LAND


def test_cut_beats_all_and_latches():
    bench = Bench().fly()
    bench.order(Verb.LAND)
    bench.step()
    bench.order(Verb.CUT_MOTORS, issuer="anyone", id="cut")
    assert bench.step().action is Action.CUT
    for verb in (Verb.LAND, Verb.HOLD, Verb.TRACK, Verb.RESUME, Verb.TAKEOFF):
        assert bench.order(verb).stage is AckStage.REFUSED
    assert set(bench.run(3)) == {Action.CUT}
    bench.state = FlightState.EMERGENCY
    assert [ack.command_id for ack in bench.step().acks] == ["cut"]
    assert set(bench.run(3)) == {Action.CUT}


def test_a_new_take_off_clears_an_emergency():
    bench = Bench()
    bench.order(Verb.CUT_MOTORS)
    bench.state = FlightState.EMERGENCY
    bench.step()
    assert bench.order(Verb.TAKEOFF).stage is AckStage.ACCEPTED
    assert bench.step().action is Action.TAKE_OFF
    bench.state = FlightState.LANDED
    assert bench.step().action is Action.TAKE_OFF
    bench.state = FlightState.EMERGENCY
    assert bench.step().action is Action.CUT, "a second emergency is not cleared by the same order"


def test_an_emergency_that_does_not_clear_ends_the_take_off():
    bench = Bench(state=FlightState.EMERGENCY)
    bench.order(Verb.TAKEOFF)
    assert bench.run(1.9)[-1] is Action.TAKE_OFF
    assert bench.run(0.3)[-1] is Action.CUT


def test_an_emergency_in_flight_is_no_landing():
    bench = Bench().fly()
    bench.state = FlightState.EMERGENCY
    assert bench.step().mode is Mode.CUT


def test_a_vehicle_that_lands_by_itself_is_not_taken_up_again():
    bench = Bench().fly()
    bench.state = FlightState.LANDING
    assert bench.step().action is Action.LAND
    bench.state = FlightState.HOVERING
    assert bench.step().action is Action.LAND


def test_a_vehicle_that_flies_without_order_is_landed():
    bench = Bench()
    bench.state = FlightState.FLYING
    assert bench.step().action is Action.LAND
