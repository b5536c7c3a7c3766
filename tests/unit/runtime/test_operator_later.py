"""The operator of a team in the air: a restarted driver, and a later take-off of others."""

import pytest
from operated_team import Scene

from groundstation.bus.memory_bus import MemoryBus
from groundstation.bus.messages import (
    Command,
    FlightState,
    Verb,
)
from groundstation.bus.topics import COMMAND
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
