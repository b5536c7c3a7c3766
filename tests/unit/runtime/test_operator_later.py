"""The operator of a team in the air: a restarted driver, and a later take-off of others."""

import pytest
from operated_team import Scene

from groundstation.bus.memory_bus import MemoryBus
from groundstation.bus.messages import OPERATOR, AckStage, Command, CommandAck, FlightState, Verb
from groundstation.bus.topics import COMMAND, COMMAND_ACK
from groundstation.runtime.team import TeamPhase


def test_a_driver_that_starts_anew_and_hears_nothing_lands_no_drone(scene: Scene) -> None:
    flying = scene.add("drone_1")
    flying.state = FlightState.FLYING
    list(scene.run(0.1))
    flying.state = FlightState.UNKNOWN  # as reported by its restarted driver
    list(scene.run(0.5))
    assert not scene.operator.landed(scene.now_ns)
    assert scene.operator.team.airborne(scene.now_ns) == ("drone_1",)
    flying.state = FlightState.LANDED
    list(scene.run(0.1))
    assert scene.operator.landed(scene.now_ns)
    flying.state = FlightState.UNKNOWN
    list(scene.run(0.1))
    assert scene.operator.landed(scene.now_ns), "it stood when it was heard last"


@pytest.mark.parametrize("refusal", ["", "battery empty"])
def test_a_later_take_off_of_one_leaves_the_others_tracking_whatever_comes_of_it(scene: Scene, refusal: str) -> None:
    scene.add("drone_1")
    scene.pass_(0.2)
    scene.operator.take_off(scene.now_ns, ("drone_1",))
    scene.pass_(4.0)
    late = scene.add("drone_2", refusal=refusal)
    scene.pass_(0.2)
    other = MemoryBus(scene.exchange, "lab", "cli_1")
    header = other.header("operator")
    scope = ("operator", "drone_2")
    other.publish(COMMAND, Command(header=header, id="r1", verb=Verb.TAKEOFF, scope=scope, issuer="cli_1"))
    scene.pass_(8.0)
    assert late.state is (FlightState.LANDED if refusal else FlightState.HOVERING)
    assert scene.operator.phase is TeamPhase.TRACKING


def test_a_later_take_off_of_all_excludes_drones_already_flying(scene: Scene) -> None:
    flying = scene.add("drone_1")
    scene.pass_(0.2)
    scene.operator.take_off(scene.now_ns, ("drone_1",))
    scene.pass_(4.0)
    flying.seen = False  # below another one, or at the edge of the room
    late = scene.add("drone_2")
    scene.pass_(3.0)
    other = MemoryBus(scene.exchange, "lab", "cli_1")
    request = Command(header=other.header("operator"), id="r1", verb=Verb.TAKEOFF, scope=("operator",), issuer="cli_1")
    other.publish(COMMAND, request)
    scene.pass_(14.0)
    assert flying.heard == [Verb.TAKEOFF, Verb.TRACK] and flying.state is FlightState.HOVERING
    assert late.heard == [Verb.TAKEOFF] and late.state is FlightState.HOVERING


def ask(scene: Scene, verb: Verb, *names: str) -> list[tuple[AckStage, str]]:
    """Ask the operator from another shell; returns the answers within half a second."""
    other = MemoryBus(scene.exchange, "lab", "cli_1")
    answers = other.subscribe([COMMAND_ACK], entity=OPERATOR)
    scope = (OPERATOR, *names)
    header = other.header("team", scene.now_ns + 1)
    other.publish(COMMAND, Command(header=header, id=f"{verb}-{scene.now_ns}", verb=verb, scope=scope, issuer="cli_1"))
    scene.pass_(0.5)
    acks = [r.message for r in answers.drain() if isinstance(r.message, CommandAck)]
    return [(ack.stage, ack.reason) for ack in acks]


@pytest.mark.parametrize("names", [(), ("drone_1", "drone_2")], ids=["all", "by name"])
def test_a_take_off_lands_no_drone_that_was_silent_when_it_began(scene: Scene, names: tuple[str, ...]) -> None:
    tracking, late = scene.add("drone_1"), scene.add("drone_2")
    scene.pass_(0.2)
    scene.operator.take_off(scene.now_ns, ("drone_1",))
    scene.pass_(4.0)
    tracking.seen, tracking.mode = False, "TRACK"
    scene.pass_(3.0)
    tracking.state = FlightState.LOST  # a gap in its telemetry
    scene.pass_(0.2)
    ask(scene, Verb.TAKEOFF, *names)
    tracking.state = FlightState.FLYING
    scene.pass_(30.0)
    assert tracking.heard == [Verb.TAKEOFF, Verb.TRACK], "others' cameras localise it"
    assert late.heard == [Verb.TAKEOFF] and late.state is FlightState.HOVERING


def test_a_drone_that_turns_out_to_fly_is_neither_awaited_nor_landed(scene: Scene) -> None:
    one, two = scene.add("drone_1", seen=False), scene.add("drone_2")
    one.state, one.mode = FlightState.UNKNOWN, "CONNECTING"
    scene.pass_(0.2)
    ask(scene, Verb.TAKEOFF)
    one.state, one.mode = FlightState.FLYING, "TRACK"
    scene.pass_(15.0)
    assert one.heard == [] and "drone_1: flies already" in scene.said
    assert two.heard == [Verb.TAKEOFF] and two.state is FlightState.HOVERING


def test_a_drone_that_lands_is_not_counted_as_flying(scene: Scene) -> None:
    one = scene.add("drone_1", refusal="already LANDING")
    scene.add("drone_2").state = FlightState.HOVERING
    one.state, one.mode = FlightState.LANDING, "LANDING"
    scene.pass_(0.2)
    ask(scene, Verb.TAKEOFF)
    one.state, one.mode, one.refusal = FlightState.LANDED, "LANDED", ""
    scene.pass_(4.0)
    assert one.state is FlightState.HOVERING and Verb.LAND not in one.heard


@pytest.fixture(params=[TeamPhase.TRACKING, TeamPhase.HELD])
def second_rises(scene: Scene, request: pytest.FixtureRequest) -> Scene:
    """Return a team of which drone_1 tracks or holds and drone_2 takes off, and is not seen yet."""
    scene.add("drone_1")
    scene.pass_(0.2)
    scene.operator.take_off(scene.now_ns, ("drone_1",))
    scene.pass_(4.0)
    if request.param is TeamPhase.HELD:
        ask(scene, Verb.HOLD)
    assert scene.operator.phase is request.param
    scene.add("drone_2", seen=False)
    scene.pass_(0.2)
    assert ask(scene, Verb.TAKEOFF, "drone_2")[-1][0] is AckStage.ACCEPTED
    scene.pass_(1.0)
    assert scene.operator.phase is TeamPhase.TAKING_OFF
    return scene


@pytest.mark.parametrize("verb", [Verb.RESUME, Verb.TRACK])
@pytest.mark.parametrize("names", [(), ("drone_1",)], ids=["all", "by name"])
def test_who_flies_may_go_on_while_another_takes_off(second_rises: Scene, verb: Verb, names: tuple[str, ...]) -> None:
    scene = second_rises
    answers = ask(scene, verb, *names)
    assert (AckStage.ACCEPTED, "") in answers
    assert scene.drones["drone_1"].heard[-1] is verb
    assert scene.drones["drone_2"].heard == [Verb.TAKEOFF], "its take-off is not over"
    phases = [scene.operator.phase]
    scene.drones["drone_2"].seen = True
    scene.pass_(2.0)
    assert [*phases, scene.operator.phase] == [TeamPhase.TAKING_OFF, TeamPhase.TRACKING]


@pytest.mark.parametrize("verb", [Verb.RESUME, Verb.TRACK])
def test_who_waits_in_a_take_off_may_not_go_on(second_rises: Scene, verb: Verb) -> None:
    refused = (AckStage.REFUSED, "drone_2 is taking off")
    for names in (("drone_2",), ("drone_1", "drone_2")):
        assert ask(second_rises, verb, *names)[-1] == refused
    assert ask(second_rises, Verb.TAKEOFF, "drone_1")[-1] == refused
    assert second_rises.drones["drone_2"].heard == [Verb.TAKEOFF]
