"""Requests of other shells to the operator, and the recipients of the commands; each goes only to the named drones."""

from dataclasses import replace

import pytest
from msgspec import structs

from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import OPERATOR, AckStage, Command, CommandAck, FlightState, VehicleStatus, Verb
from groundstation.bus.topics import COMMAND, COMMAND_ACK, LEASE, VEHICLE_STATUS
from groundstation.runtime.asking import by_clock_of
from groundstation.runtime.operator import Operator
from groundstation.runtime.take_off import TakeOffLimits
from groundstation.runtime.team import TeamPhase

S = 10**9
UP, DOWN = FlightState.HOVERING, FlightState.LANDED


class Desk:
    """An operator of drones with given telemetry, and another shell."""

    def __init__(self, run="", **states):
        exchange = MemoryExchange()
        self.said: list[str] = []
        self.now_ns = clock.now_ns() // S * S
        self.shell = MemoryBus(exchange, "lab", "cli_1")
        self.drones = {name: (MemoryBus(exchange, "lab", name), state) for name, state in states.items()}
        bus = MemoryBus(exchange, "lab", "supervisor", run)
        self.operator = Operator(bus, tuple(states), {}, TakeOffLimits(), self.said.append)
        self.given = self.shell.subscribe([COMMAND])
        self.answers = self.shell.subscribe([COMMAND_ACK], entity=OPERATOR)
        self.turn()

    def turn(self, seconds=0.1):
        for name, (bus, state) in self.drones.items():
            bus.publish(VEHICLE_STATUS, VehicleStatus(header=bus.header(name), flight_state=state, mode="HOVER"))
        self.now_ns += round(seconds * S)
        self.operator.step(self.now_ns)

    def command(self, verb, *scope, identity="r", age_s=0.0, lives_s=0.0):
        header = self.shell.header("team", self.now_ns - round(age_s * S))
        expires_ns = header.stamp_ns + round(lives_s * S) if lives_s else 0
        return Command(header=header, id=identity, verb=verb, scope=scope, issuer="cli_1", expires_ns=expires_ns)

    def send(self, command):
        self.shell.publish(COMMAND, command)
        self.turn()

    def ask(self, verb, *scope, identity="r"):
        self.send(self.command(verb, *scope, identity=identity))

    def confirm(self, *stages, refused=()):
        """Let every drone answer the newest command of the operator."""
        command = self.orders()[-1]
        for name in command.scope or tuple(self.drones):
            bus, _ = self.drones[name]
            for stage in (AckStage.REFUSED,) if name in refused else stages:
                ack = CommandAck(header=bus.header(name), command_id=command.id, verb=command.verb, stage=stage)
                bus.publish(COMMAND_ACK, ack)
        self.turn()

    def orders(self):
        self._orders = [*getattr(self, "_orders", []), *(r.message for r in self.given.drain())]
        return [command for command in self._orders if command.issuer == OPERATOR]

    def stages(self):
        answers = [r.message for r in self.answers.drain() if isinstance(r.message, CommandAck)]
        return [(ack.stage, ack.reason) for ack in answers]


DONE = (AckStage.RECEIVED, AckStage.ACCEPTED, AckStage.EFFECTIVE)


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
