"""A drone whose emergency a TAKEOFF ended is started by a person's next one only, never by a repetition."""

from operated_team import CLEARED, Drone, Scene

from groundstation.bus.memory_bus import MemoryBus
from groundstation.bus.messages import OPERATOR, AckStage, Command, CommandAck, Event, FlightState, Verb
from groundstation.bus.topics import COMMAND, COMMAND_ACK, EVENT


def team_after_a_fall(scene: Scene) -> tuple[Drone, Drone]:
    fallen, whole = scene.add("drone_1"), scene.add("drone_2")
    fallen.state = FlightState.EMERGENCY
    scene.pass_(0.2)
    return fallen, whole


def stands(drone: Drone) -> bool:
    return bool(drone.state is FlightState.LANDED)


def press(scene: Scene, *names: str) -> list[CommandAck]:
    """Press TAKE OFF once on a page; returns the operator's answers within 8 s, in which a refusal was repeated."""
    page = MemoryBus(scene.exchange, "lab", "console")
    answers = page.subscribe([COMMAND_ACK], entity=OPERATOR)
    header = page.header(OPERATOR, scene.now_ns + 1)
    order = Command(header=header, id=f"{scene.now_ns}", verb=Verb.TAKEOFF, scope=(OPERATOR, *names), issuer="console")
    page.publish(COMMAND, order)
    scene.pass_(8.0)
    return [r.message for r in answers.drain() if isinstance(r.message, CommandAck)]


def test_one_press_ends_an_emergency_and_starts_nothing(scene: Scene) -> None:
    fallen, whole = team_after_a_fall(scene)
    events = scene.bus.subscribe([EVENT])
    end = press(scene, "drone_1")[-1]
    assert fallen.heard == [Verb.TAKEOFF] and stands(fallen)
    assert (end.stage, end.reason) == (AckStage.REFUSED, f"drone_1: refused: {CLEARED}")
    assert f"drone_1: left out, refused: {CLEARED}" in scene.said
    (event,) = [r.message for r in events.drain() if isinstance(r.message, Event)]
    assert event.remedy == "order TAKEOFF again once it stands upright"
    assert whole.heard == []
    press(scene, "drone_1")
    assert fallen.heard == [Verb.TAKEOFF, Verb.TAKEOFF] and not stands(fallen)


def test_a_press_for_the_team_starts_the_others_only(scene: Scene) -> None:
    fallen, whole = team_after_a_fall(scene)
    press(scene)
    assert fallen.heard == [Verb.TAKEOFF] and stands(fallen)
    assert whole.heard == [Verb.TAKEOFF] and whole.state is FlightState.HOVERING


def test_a_run_that_takes_off_by_itself_leaves_it_on_the_floor_as_well(scene: Scene) -> None:
    fallen, whole = team_after_a_fall(scene)
    scene.operator.take_off(scene.now_ns)
    scene.pass_(8.0)
    assert fallen.heard == [Verb.TAKEOFF] and stands(fallen)
    assert whole.heard == [Verb.TAKEOFF, Verb.TRACK]
