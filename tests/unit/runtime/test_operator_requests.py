"""Requests of other shells to the operator, and the recipients of the commands; each goes only to the named drones."""

import pytest
from operator_desk import DONE, DOWN, UP, Desk, S

from groundstation.bus.messages import OPERATOR, AckStage, Command, Verb
from groundstation.bus.topics import COMMAND
from groundstation.runtime.team import TeamPhase


@pytest.mark.parametrize("verb", [Verb.RESUME, Verb.HOLD, Verb.LAND, Verb.TRACK])
def test_a_request_goes_to_the_drones_that_it_names_alone_and_is_answered(verb):
    desk = Desk(drone_1=UP, drone_2=UP)
    desk.ask(verb, OPERATOR, "drone_2")
    assert [(order.verb, order.scope) for order in desk.orders()] == [(verb, ("drone_2",))]
    assert [stage for stage, _ in desk.stages()] == [AckStage.RECEIVED, AckStage.ACCEPTED]
    desk.confirm(*DONE)
    assert desk.stages() == [(AckStage.EFFECTIVE, "")]


@pytest.mark.parametrize(("verb", "phase"), [(Verb.RESUME, TeamPhase.TRACKING), (Verb.HOLD, TeamPhase.HELD)])
def test_only_what_moves_drones_again_is_tracking(verb, phase):
    desk = Desk(drone_1=UP)
    desk.ask(verb, OPERATOR, "drone_1")
    desk.confirm(*DONE)
    assert desk.operator.phase is phase


@pytest.mark.parametrize("verb", [Verb.TRACK, Verb.RESUME])
def test_a_command_refused_by_all_leaves_the_team_grounded(verb):
    desk = Desk(drone_1=DOWN)
    desk.ask(verb, OPERATOR)
    desk.confirm(refused=("drone_1",))
    assert desk.operator.phase is TeamPhase.GROUND and not desk.operator.tracking_since_ns


def test_a_team_that_is_held_during_its_take_off_tracks_from_its_resume_on():
    desk = Desk(drone_1=UP)
    desk.send(desk.command(Verb.HOLD, identity="h"))
    desk.ask(Verb.RESUME, OPERATOR)
    assert not desk.operator.tracking_since_ns
    desk.confirm(*DONE)
    assert desk.operator.phase is TeamPhase.TRACKING and desk.operator.tracking_since_ns == desk.now_ns


def test_stops_never_expire_and_starts_do():
    desk = Desk(drone_1=UP)
    desk.ask(Verb.RESUME, OPERATOR, "drone_1", identity="a")
    desk.ask(Verb.LAND, OPERATOR, "drone_1", identity="b")
    start, stop = desk.orders()
    assert start.expires_ns == start.header.stamp_ns + 5 * S and stop.expires_ns == 0
    assert start.id != stop.id


def test_a_refusal_of_one_is_the_answer_with_its_name():
    desk = Desk(drone_1=UP, drone_2=UP)
    desk.ask(Verb.RESUME, OPERATOR, "drone_1", "drone_2")
    desk.stages()
    desk.confirm(*DONE, refused=("drone_1",))
    ((stage, reason),) = desk.stages()
    assert stage is AckStage.REFUSED and reason.startswith("drone_1: ") and "drone_2" not in reason


def test_strangers_and_repetitions_order_nothing():
    desk = Desk(drone_1=UP)
    desk.ask(Verb.RESUME, OPERATOR, "drone_9")
    assert desk.stages() == [(AckStage.RECEIVED, ""), (AckStage.REFUSED, "there is no drone drone_9")]
    assert desk.orders() == []
    for _ in range(2):
        desk.ask(Verb.RESUME, OPERATOR, "drone_1", identity="same")
    assert len({order.id for order in desk.orders()}) == 1
    assert [stage for stage, _ in desk.stages()] == [AckStage.RECEIVED, AckStage.ACCEPTED, AckStage.ACCEPTED]


def test_nothing_else_is_begun_during_a_take_off_and_its_request_is_not_begun_twice():
    desk = Desk(drone_1=DOWN)
    for _ in range(2):
        desk.ask(Verb.TAKEOFF, OPERATOR, "drone_1", identity="t")
    desk.ask(Verb.RESUME, OPERATOR, "drone_1", identity="r")
    begun = [AckStage.RECEIVED, AckStage.ACCEPTED]
    assert [stage for stage, _ in desk.stages()] == [*begun, AckStage.ACCEPTED, AckStage.RECEIVED, AckStage.REFUSED]
    assert {order.verb for order in desk.orders()} == {Verb.TAKEOFF}


def test_drivers_are_told_when_a_start_was_asked_for():
    desk = Desk(drone_1=UP)
    asked = desk.command(Verb.RESUME, OPERATOR, age_s=0.5)
    desk.send(asked)
    (order,) = desk.orders()
    assert order.header.stamp_ns == asked.header.stamp_ns  # a stop that they received in between overtakes it


def test_a_request_that_lay_somewhere_for_too_long_is_refused():
    desk = Desk(drone_1=UP)
    desk.send(desk.command(Verb.TRACK, OPERATOR, age_s=7, lives_s=5))
    assert desk.stages()[-1] == (AckStage.REFUSED, "given 7 s ago")


@pytest.mark.parametrize(("verb", "limit_s"), [(Verb.LAND, 20.0), (Verb.RESUME, 6.0)])
def test_an_order_that_nobody_answers_is_given_up_after_its_time_and_not_before(verb, limit_s):
    desk = Desk(drone_1=UP)
    began_ns = desk.now_ns - round(0.1 * S)
    desk.ask(verb, OPERATOR, "drone_1")
    desk.stages()
    while desk.now_ns < began_ns + (limit_s - 0.1) * S:
        desk.turn()
    assert desk.stages() == [] and len(desk.orders()) > 3
    for _ in range(6):
        desk.turn()
    ((stage, reason),) = desk.stages()
    assert stage is AckStage.REFUSED and "NOT CONFIRMED" in reason
    count = len(desk.orders())
    desk.turn(5.0)
    assert len(desk.orders()) == count


def test_a_stop_of_all_drones_by_name_is_one_of_the_team_and_a_stop_of_some_is_not():
    desk = Desk(drone_1=UP, drone_2=UP)
    desk.operator.track(desk.now_ns)
    desk.confirm(*DONE)
    desk.ask(Verb.LAND, "drone_1", identity="a")
    phases = [desk.operator.phase]
    for verb, scope, identity in ((Verb.HOLD, ("drone_1", "drone_2"), "b"), (Verb.LAND, (), "c"), (Verb.HOLD, (), "d")):
        desk.ask(verb, *scope, identity=identity)
        phases.append(desk.operator.phase)
    # The last: a landing is not cancelled.
    assert phases == [TeamPhase.TRACKING, TeamPhase.HELD, TeamPhase.LANDING, TeamPhase.LANDING]
    assert sum("by cli_1" in line for line in desk.said) == 2


def test_landing_is_ordered_once_and_drops_what_was_to_start():
    desk = Desk(drone_1=UP)
    desk.operator.track(desk.now_ns)
    desk.operator.land(desk.now_ns)
    desk.operator.land(desk.now_ns)
    assert [order.verb for order in desk.orders()] == [Verb.TRACK, Verb.LAND]
    assert desk.orders()[-1].scope == ()
    desk.turn(1.0)
    assert desk.orders()[-1].verb is Verb.LAND and Verb.TRACK not in [o.verb for o in desk.orders()[2:]]


@pytest.mark.parametrize(
    ("run", "age_s", "phase"),
    [("lab-2", 0, TeamPhase.LANDING), ("lab-1", 0, TeamPhase.GROUND), ("lab-2", 45, TeamPhase.GROUND)],
    ids=["now", "of another run", "old"],
)
def test_a_stop_that_no_driver_obeys_changes_nothing(run, age_s, phase):
    desk = Desk(run="lab-2", drone_1=UP)
    header = desk.shell.header("team", desk.now_ns - age_s * S)
    stop = Command(header=header, id="s", verb=Verb.CUT_MOTORS, scope=(), issuer="cli_1", run=run)
    desk.shell.publish(COMMAND, stop)
    desk.turn()
    assert desk.operator.phase is phase
    assert bool(desk.said) is (phase is TeamPhase.LANDING)


@pytest.mark.parametrize("verb", [Verb.LAND, Verb.HOLD, Verb.CUT_MOTORS])
def test_a_stop_before_the_take_off_leaves_the_team_on_the_ground(verb):
    desk = Desk(drone_1=DOWN)
    desk.send(desk.command(verb, identity="x"))
    desk.turn()
    assert desk.operator.phase is TeamPhase.GROUND and f"{verb} by cli_1" in desk.said
    desk.drones["drone_1"] = (desk.drones["drone_1"][0], UP)  # its pilot took off by remote control
    desk.turn()
    desk.send(desk.command(verb, identity="y"))
    desk.turn()
    assert desk.operator.phase is (TeamPhase.HELD if verb is Verb.HOLD else TeamPhase.LANDING)


def test_landing_is_ordered_although_another_shell_has_ordered_it():
    """That LAND may have been lost on its way to one drone, with the shell that would have repeated it."""
    desk = Desk(drone_1=UP, drone_2=UP)
    desk.send(desk.command(Verb.LAND))
    assert desk.operator.phase is TeamPhase.LANDING
    desk.operator.land(desk.now_ns)
    desk.operator.land(desk.now_ns)
    assert [order.verb for order in desk.orders()] == [Verb.LAND], "once"
