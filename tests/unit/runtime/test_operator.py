"""The operator on a memory bus: lease, take-off one by one, stops from elsewhere, requests of other shells."""

import pytest
from operated_team import Scene

from groundstation.bus.memory_bus import MemoryBus
from groundstation.bus.messages import (
    AckStage,
    Command,
    CommandAck,
    FlightState,
    Lease,
    Verb,
)
from groundstation.bus.topics import COMMAND, COMMAND_ACK, LEASE
from groundstation.runtime.team import TeamPhase


def test_lease_is_renewed_twice_a_second(scene: Scene) -> None:
    leases = scene.bus.subscribe([LEASE])
    scene.pass_(2.0)
    heard = [r.message for r in leases.drain()]
    assert 4 <= len(heard) <= 5
    assert all(isinstance(lease, Lease) and lease.holder == "operator" for lease in heard)


def test_one_by_one_then_track(scene: Scene) -> None:
    one, two = scene.add("drone_1"), scene.add("drone_2")
    scene.pass_(0.2)
    scene.operator.take_off(scene.now_ns)
    for _ in scene.run(5.0):
        if Verb.TAKEOFF in two.heard:
            assert one.state is FlightState.HOVERING
    assert one.heard == two.heard == [Verb.TAKEOFF, Verb.TRACK]
    assert scene.operator.phase is TeamPhase.TRACKING and scene.operator.tracking_since_ns
    assert scene.operator.mistake is None
    assert "drone_1: TAKEOFF sent / received / accepted / effective" in scene.said


@pytest.mark.parametrize("reports", [True, False])
def test_exchanged_drones_stop_the_take_off_and_the_one_that_flies_lands(scene: Scene, reports: bool) -> None:
    one = scene.add("drone_1", marker="drone_2", reports=reports)
    two = scene.add("drone_2", marker="drone_1", reports=reports)
    scene.pass_(0.5)
    scene.operator.take_off(scene.now_ns)
    scene.pass_(10.0)
    assert (one.heard, two.heard) == ([Verb.TAKEOFF, Verb.LAND], [])
    assert one.state is FlightState.LANDED and scene.operator.phase is TeamPhase.GROUND
    says = "drone_1 reports 0.8 m" if reports else "drone_1 says that it flies"
    mistake = (
        f"{says} but its marker is on the floor and drone_2's marker rose: the addresses or markers of the two are "
        "probably exchanged; check address, system id and marker code of drone_1 and drone_2 in the field file "
    )
    assert sum(line.startswith(f"TAKE-OFF STOPPED: {mistake}") for line in scene.said) == 1
    assert str(scene.operator.mistake).startswith(mistake)
    assert "drone_2: left out, the take-off was stopped" in scene.said
    assert not any("localised" in line for line in scene.said)


def test_a_mix_up_among_the_others_lets_who_was_seen_hover_without_tracking(scene: Scene) -> None:
    one = scene.add("drone_1")
    two = scene.add("drone_2", marker="stranger")
    scene.add("its_marker_on_the_floor", marker="drone_2")
    scene.pass_(0.5)
    scene.operator.take_off(scene.now_ns)
    scene.pass_(12.0)
    assert (one.heard, two.heard) == ([Verb.TAKEOFF], [Verb.TAKEOFF, Verb.LAND])
    assert scene.operator.phase is TeamPhase.UP
    assert any("drone_2 reports 0.8 m but its marker is on the floor and no other rose" in s for s in scene.said)


def test_missing_drone_is_named_and_the_rest_flies_on(scene: Scene) -> None:
    two = scene.add("drone_2")
    scene.operator.take_off(scene.now_ns)
    scene.pass_(4.5)
    assert two.heard == []
    scene.pass_(5.0)
    assert two.heard == [Verb.TAKEOFF, Verb.TRACK]
    assert any(line.startswith("drone_1: left out") for line in scene.said)


def test_unseen_drone_lands(scene: Scene) -> None:
    one = scene.add("drone_1", seen=False)
    two = scene.add("drone_2")
    scene.operator.take_off(scene.now_ns)
    scene.pass_(16.0)
    assert one.heard == [Verb.TAKEOFF, Verb.LAND] and one.state is FlightState.LANDED
    assert two.heard == [Verb.TAKEOFF, Verb.TRACK]
    assert "drone_1: left out, it flies, but no fixed camera has seen it for 10 s: it lands again" in scene.said


def test_refusal_is_retried_then_reported_with_its_reason(scene: Scene) -> None:
    one, two = scene.add("drone_1", refusal="battery"), scene.add("drone_2")
    scene.operator.take_off(scene.now_ns)
    scene.pass_(9.0)
    assert one.heard.count(Verb.TAKEOFF) > 2
    assert "drone_1: left out, refused: battery" in scene.said
    assert two.state is FlightState.HOVERING


@pytest.mark.parametrize("verb", [Verb.LAND, Verb.HOLD, Verb.CUT_MOTORS])
def test_a_stop_by_anyone_ends_the_take_off(scene: Scene, verb: Verb) -> None:
    scene.add("drone_1", seen=False)
    two = scene.add("drone_2")
    scene.operator.take_off(scene.now_ns)
    scene.pass_(2.0)
    other = MemoryBus(scene.exchange, "lab", "cli_1")
    other.publish(COMMAND, Command(header=other.header("team"), id="x", verb=verb, scope=(), issuer="cli_1"))
    scene.pass_(20.0)
    assert two.heard == [verb]


def test_a_stop_of_one_drone_leaves_the_others_to_go_on(scene: Scene) -> None:
    one, two = scene.add("drone_1", seen=False), scene.add("drone_2")
    scene.operator.take_off(scene.now_ns)
    scene.pass_(2.0)
    tracker = MemoryBus(scene.exchange, "lab", "tracker")
    command = Command(header=tracker.header("team"), id="x", verb=Verb.LAND, scope=("drone_1",), issuer="tracker")
    tracker.publish(COMMAND, command)
    scene.pass_(4.0)
    assert one.heard == [Verb.TAKEOFF, Verb.LAND]
    assert two.heard == [Verb.TAKEOFF, Verb.TRACK]


def test_a_drone_that_was_named_twice_does_not_start_again_after_its_stop(scene: Scene) -> None:
    one, two = scene.add("drone_1", seen=False), scene.add("drone_2")
    scene.pass_(0.2)
    scene.operator.take_off(scene.now_ns, ("drone_1", "drone_1", "drone_2"))
    scene.pass_(0.3)
    shell = MemoryBus(scene.exchange, "lab", "cli_1")
    command = Command(header=shell.header("team"), id="x", verb=Verb.LAND, scope=("drone_1",), issuer="cli_1")
    shell.publish(COMMAND, command)
    scene.pass_(20.0)
    assert one.heard == [Verb.TAKEOFF, Verb.LAND]
    assert two.heard == [Verb.TAKEOFF, Verb.TRACK]


def test_unheard_order_is_repeated_with_the_same_id(scene: Scene) -> None:
    scene.add("drone_1")
    scene.pass_(0.2)
    del scene.drones["drone_1"]
    spy = scene.bus.subscribe([COMMAND])
    scene.operator.land(scene.now_ns)
    scene.pass_(1.0)
    commands = [r.message for r in spy.drain()]
    assert len(commands) >= 3
    assert len({command.id for command in commands if isinstance(command, Command)}) == 1
    scene.pass_(25.0)
    assert "drone_1: LAND sent / NOT CONFIRMED" in scene.said


@pytest.mark.parametrize("stage", [AckStage.RECEIVED, AckStage.ACCEPTED, AckStage.EFFECTIVE])
def test_an_answer_lost_on_the_bus_is_asked_for_again(scene: Scene, stage: AckStage) -> None:
    drone = scene.add("drone_1")
    scene.pass_(0.2)
    drone.lost = stage
    scene.operator.land(scene.now_ns)
    scene.pass_(3.0)
    assert drone.heard == [Verb.LAND]
    assert "drone_1: LAND sent / received / accepted / effective" in scene.said


def test_another_shell_may_ask_for_take_off(scene: Scene) -> None:
    scene.add("drone_1")
    scene.add("drone_2")
    other = MemoryBus(scene.exchange, "lab", "cli_1")
    acks = other.subscribe([COMMAND_ACK], entity="operator")
    request = Command(
        header=other.header("operator"), id="r1", verb=Verb.TAKEOFF, scope=("operator",), issuer="cli_1", expires_ns=0
    )
    scene.pass_(0.2)
    other.publish(COMMAND, request)
    scene.pass_(5.0)
    stages = [r.message.stage for r in acks.drain() if isinstance(r.message, CommandAck)]
    assert stages == [AckStage.RECEIVED, AckStage.ACCEPTED, AckStage.EFFECTIVE]
    phases = [scene.operator.phase]
    other.publish(COMMAND, Command(header=other.header("operator"), id="r2", verb=Verb.TRACK, scope=("operator",),
                                   issuer="cli_1", expires_ns=0))  # fmt: skip
    scene.pass_(2.0)
    stages = [r.message.stage for r in acks.drain() if isinstance(r.message, CommandAck)]
    assert stages == [AckStage.RECEIVED, AckStage.ACCEPTED, AckStage.EFFECTIVE]
    assert [*phases, scene.operator.phase] == [TeamPhase.UP, TeamPhase.TRACKING]


def test_landed_means_all_say_so(scene: Scene) -> None:
    scene.add("drone_1")
    two = scene.add("drone_2")
    scene.operator.take_off(scene.now_ns)
    scene.pass_(4.0)
    assert not scene.operator.landed(scene.now_ns)
    scene.operator.land(scene.now_ns)
    scene.pass_(1.5)
    assert scene.operator.landed(scene.now_ns)
    two.state = FlightState.LOST
    scene.pass_(0.2)
    assert not scene.operator.landed(scene.now_ns), "a lost drone is not known to stand"
    two.mode = "LANDED"
    scene.pass_(0.2)
    assert scene.operator.landed(scene.now_ns), "but one whose battery is taken out after its landing is"
    two.state, two.mode = FlightState.UNKNOWN, "CONNECTING"
    scene.pass_(0.2)
    assert scene.operator.landed(scene.now_ns), "also where its driver is started anew"
