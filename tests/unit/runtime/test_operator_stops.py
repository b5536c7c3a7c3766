"""A stop at the operator ends and voids every start that was given before it, however late either arrives."""

from dataclasses import replace

import pytest
from msgspec import structs
from operator_desk import DONE, DOWN, UP, Desk, S

from groundstation.bus import clock
from groundstation.bus.messages import OPERATOR, AckStage, CommandAck, Verb
from groundstation.bus.topics import COMMAND, COMMAND_ACK, LEASE
from groundstation.runtime.asking import by_clock_of
from groundstation.runtime.team import TeamPhase


@pytest.mark.parametrize("scope", [(), ("drone_1",), ("drone_1", "drone_2")], ids=["all", "one", "all by name"])
@pytest.mark.parametrize("stop", [Verb.HOLD, Verb.LAND])
@pytest.mark.parametrize("start", [Verb.TAKEOFF, Verb.TRACK, Verb.RESUME])
def test_a_start_that_is_repeated_after_a_stop_is_not_begun_again(start, stop, scope):
    desk = Desk(**dict.fromkeys(("drone_1", "drone_2"), DOWN if start is Verb.TAKEOFF else UP))
    request = desk.command(start, OPERATOR, identity="start", age_s=3)
    desk.send(request)
    desk.send(desk.command(stop, *scope, identity="stop", age_s=2))
    desk.stages()
    begun = [order for order in desk.orders() if order.verb is start]
    desk.send(request)
    assert [order for order in desk.orders() if order.verb is start and order.id not in {o.id for o in begun}] == []
    if scope != ("drone_1",):
        assert desk.stages() == [(AckStage.REFUSED, f"{stop} by cli_1 came after it")]


@pytest.mark.parametrize("clock_id", ["", "another host's"])
def test_a_stop_that_is_repeated_ends_no_start_that_came_after_it(clock_id):
    desk = Desk(drone_1=UP, drone_2=UP)
    stop = desk.command(Verb.HOLD, identity="stop", age_s=2)
    if clock_id:
        stop = structs.replace(stop, header=structs.replace(stop.header, clock=clock_id))
    desk.send(stop)
    desk.send(desk.command(Verb.TRACK, OPERATOR, identity="start", age_s=-0.2 if clock_id else 1))
    desk.send(stop)
    assert sum("HOLD by" in line for line in desk.said) == 1
    desk.confirm(*DONE)
    assert desk.operator.phase is TeamPhase.TRACKING
    assert desk.stages()[-1] == (AckStage.EFFECTIVE, "")


@pytest.mark.parametrize("scope", [(), ("drone_1",)], ids=["all", "one"])
def test_a_start_that_arrives_after_a_later_stop_is_refused_and_a_new_one_is_not(scope):
    desk = Desk(drone_1=UP, drone_2=UP)
    desk.send(desk.command(Verb.HOLD, *scope, identity="stop", age_s=2))
    desk.send(desk.command(Verb.TRACK, OPERATOR, identity="late", age_s=3))
    assert desk.stages()[-1] == (AckStage.REFUSED, "HOLD by cli_1 came after it")
    desk.send(desk.command(Verb.TRACK, OPERATOR, identity="new", age_s=1))
    assert desk.stages()[-1] == (AckStage.ACCEPTED, "")


@pytest.mark.parametrize("start", [Verb.RESUME, Verb.TRACK, Verb.TAKEOFF])
def test_a_stop_that_waits_behind_a_start_ends_it_before_it_is_passed_on(start):
    desk = Desk(drone_1=UP, drone_2=DOWN)
    desk.shell.publish(COMMAND, desk.command(start, OPERATOR, identity="start", age_s=0.03))
    desk.shell.publish(COMMAND, desk.command(Verb.HOLD, identity="stop", age_s=0.02))
    desk.turn()
    assert desk.orders() == []
    assert desk.stages()[-1] == (AckStage.REFUSED, "HOLD by cli_1 came after it")


@pytest.mark.parametrize(("start", "goes_on"), [(Verb.TAKEOFF, []), (Verb.TRACK, [("drone_2",)])])
def test_a_start_is_repeated_no_more_to_a_drone_that_was_stopped_alone(start, goes_on):
    """Its driver may be restarted meanwhile, and has then forgotten the stop."""
    desk = Desk(**dict.fromkeys(("drone_1", "drone_2"), DOWN if start is Verb.TAKEOFF else UP))
    desk.ask(start, OPERATOR, *(("drone_1",) if start is Verb.TAKEOFF else ()), identity="start")
    begun = desk.orders()
    desk.send(desk.command(Verb.LAND, "drone_1", identity="stop"))
    desk.turn(1.5)
    repeated = desk.orders()[len(begun) :]
    assert [order.scope for order in repeated] == goes_on
    assert {order.id for order in repeated} <= {order.id for order in begun}
    bus, _ = desk.drones["drone_2"]
    for order in repeated:
        ack = CommandAck(header=bus.header("drone_2"), command_id=order.id, verb=start, stage=AckStage.EFFECTIVE)
        bus.publish(COMMAND_ACK, ack)
    desk.turn()
    stage, reason = desk.stages()[-1]
    assert stage is AckStage.REFUSED and reason.startswith("drone_1: ") and "LAND by cli_1" in reason


@pytest.mark.parametrize("flies", [False, True], ids=["all stand", "one flies"])
def test_a_driver_that_somebody_signalled_ends_every_start_of_the_team(flies):
    """`groundstation land` signals the drivers of its host if no router answers; those of other hosts it cannot."""
    desk = Desk(drone_1=DOWN, drone_2=DOWN, drone_3=UP if flies else DOWN)
    if flies:
        desk.operator.track(desk.now_ns)
        desk.confirm(*DONE)
    late = desk.command(Verb.TRACK, OPERATOR, identity="late")
    desk.ask(Verb.TAKEOFF, OPERATOR, "drone_1", "drone_2", identity="start")
    begun = desk.orders()
    desk.operator.heed_signal("drone_1", desk.now_ns)
    assert desk.stages()[-1] == (AckStage.REFUSED, "LAND by a signal to drone_1 came after it")
    assert desk.operator.phase is (TeamPhase.TRACKING if flies else TeamPhase.LANDING)
    for _ in range(200):
        desk.turn()
    desk.send(late)
    assert desk.orders() == begun and desk.stages()[-1][0] is AckStage.REFUSED
    desk.ask(Verb.TAKEOFF, OPERATOR, "drone_1", identity="anew")
    assert desk.stages()[-1] == (AckStage.ACCEPTED, "")


@pytest.mark.parametrize("names", [(), ("drone_1",)], ids=["all", "one"])
def test_a_stop_that_is_asked_of_the_operator_ends_the_take_off_and_every_earlier_start(names):
    desk = Desk(drone_1=DOWN, drone_2=DOWN)
    desk.ask(Verb.TAKEOFF, OPERATOR, "drone_1", identity="start")
    late = desk.command(Verb.RESUME, OPERATOR, "drone_1", identity="late", age_s=-0.05)
    desk.turn()
    desk.ask(Verb.LAND, OPERATOR, *names, identity="stop")
    desk.turn(1.0)
    desk.send(late)
    assert {(order.verb, order.scope) for order in desk.orders() if order.verb.stops} == {(Verb.LAND, names)}
    assert desk.orders()[-1].verb is Verb.LAND, "nothing is started any more"
    assert desk.stages()[-1] == (AckStage.REFUSED, "LAND by cli_1 came after it")


def test_a_stop_that_lay_somewhere_for_too_long_is_not_passed_on():
    desk = Desk(drone_1=UP)
    desk.send(desk.command(Verb.LAND, OPERATOR, age_s=45))
    assert desk.stages()[-1] == (AckStage.REFUSED, "given 45 s ago") and desk.orders() == []


def of_another_host(desk, start, identity):
    """Return a start given now on a host whose clock is 895 s ahead, and the same by the clock of a lease it heard."""
    ahead_ns = 895 * S
    leases = desk.shell.subscribe([LEASE], newest=True)
    desk.turn(0.5)
    (lease,) = leases.drain()
    here = desk.command(start, OPERATOR, identity=identity, lives_s=5)
    header = structs.replace(here.header, stamp_ns=here.header.stamp_ns + ahead_ns, clock="another host's")
    there = structs.replace(here, header=header, expires_ns=here.expires_ns + ahead_ns)
    arrived_ns = lease.header.stamp_ns + ahead_ns + 20_000_000  # the lease was on its way for 20 ms
    return there, by_clock_of(replace(lease, arrived_ns=arrived_ns), there)


@pytest.mark.parametrize("late_s", [0.2, 3.0, 20.0])
@pytest.mark.parametrize("start", [Verb.TAKEOFF, Verb.TRACK, Verb.RESUME])
def test_a_start_of_another_host_undoes_no_later_stop_however_late_it_arrives(start, late_s):
    desk = Desk(drone_1=DOWN if start is Verb.TAKEOFF else UP)
    unknown, late = of_another_host(desk, start, "late")
    assert (late.header.clock, late.expires_ns - late.header.stamp_ns) == (clock.clock_id(), 5 * S)
    assert desk.now_ns - late.header.stamp_ns == 20_000_000, "never younger than it is"
    desk.turn(0.1)
    desk.send(desk.command(Verb.HOLD, identity="stop"))
    desk.turn(late_s)
    for given in (late, structs.replace(unknown, id="of an older version")):
        desk.send(given)
        stage, reason = desk.stages()[-1]
        assert stage is AckStage.REFUSED and ("came after it" in reason or "given" in reason)
    assert desk.orders() == []
    _, anew = of_another_host(desk, start, "anew")
    desk.send(anew)
    assert desk.stages()[-1] == (AckStage.ACCEPTED, "") and desk.orders()[-1].verb is start


def test_ctrl_c_lands_again_whom_a_start_after_an_unanswered_landing_has_lifted():
    desk = Desk(drone_1=UP, drone_2=UP)
    desk.ask(Verb.LAND, OPERATOR, identity="stop")
    desk.drones["drone_1"] = (desk.drones["drone_1"][0], DOWN)
    desk.turn()
    desk.ask(Verb.TAKEOFF, OPERATOR, "drone_1", identity="start")
    assert desk.orders()[-1].verb is Verb.TAKEOFF
    desk.operator.land(desk.now_ns)
    assert desk.orders()[-1].verb is Verb.LAND and desk.orders()[-1].scope == ()
    assert desk.operator.phase is TeamPhase.LANDING and desk.stages()[-1][0] is AckStage.REFUSED
    begun = len(desk.orders())
    desk.turn(2.0)
    desk.turn(2.0)
    assert {order.verb for order in desk.orders()[begun:]} == {Verb.LAND}


def test_ctrl_c_after_an_unanswered_landing_ends_what_was_to_start_and_every_earlier_request():
    desk = Desk(drone_1=UP, drone_2=UP)
    desk.ask(Verb.LAND, OPERATOR, identity="stop")
    desk.turn(1.0)
    late = desk.command(Verb.TRACK, OPERATOR, identity="late")
    desk.turn(1.0)
    landings = {order.id for order in desk.orders()}
    desk.operator.land(desk.now_ns)
    desk.send(late)
    assert desk.stages()[-1] == (AckStage.REFUSED, "LAND by operator came after it")
    assert {order.id for order in desk.orders()} == landings, "a LAND that nothing followed is not given twice"
