"""The page's commands on the bus: the right to give them, and their progress."""

from pathlib import Path
from typing import Any

import pytest
from msgspec import structs

from groundstation.bus import clock
from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.console.commands import CommandDesk, Given
from groundstation.console.operator_lock import OperatorLock
from groundstation.console.protocol import (
    CommandRequest,
    Drive,
    FollowPath,
    FramesHandled,
    Hello,
    Place,
    Release,
    TakeOver,
    Watch,
)
from groundstation.console.section import run_id
from groundstation.console.session import Sessions
from groundstation.console.snapshot import Snapshot
from groundstation.console.viewer import PageConnection
from groundstation.time_units import NS_PER_S

DRONES = ("drone_1", "drone_2")
RUN = "run-1"


class Room:
    def __init__(self, targets: tuple[str, ...] = ("turtlebot",)) -> None:
        exchange = MemoryExchange()
        self.bus = MemoryBus(exchange, "lab", "console")
        self.others = MemoryBus(exchange, "lab", "drone_1")
        self.heard = self.others.subscribe([t.COMMAND])
        self.steering = self.others.subscribe([t.SIM_COMMAND])
        self.desk = CommandDesk(self.bus, DRONES)
        self.sessions = Sessions(self.bus, self.desk, "secret", RUN, targets)
        self.now_ns = clock.now_ns()

    def lease(self) -> None:
        header = self.bus.header("team")
        self.desk.hear_lease(m.Lease(header=header, holder="operator", expires_ns=header.stamp_ns + 60 * NS_PER_S))

    def commands(self) -> list[m.Command]:
        return [item.message for item in self.heard.drain() if isinstance(item.message, m.Command)]

    def ack(self, command: m.Command, entity: str, stage: m.AckStage, reason: str = "") -> None:
        header = m.Header(1, "c", entity, entity, 0)
        ack = m.CommandAck(header=header, command_id=command.id, verb=command.verb, stage=stage, reason=reason)
        self.desk.take(ack, self.now_ns)

    def viewer(self, number: int, token: str = "secret") -> PageConnection:
        async def nothing(_: object) -> None:
            return None

        viewer = PageConnection(number, Snapshot(), nothing, nothing)
        self.sessions.add(viewer)
        self.sessions.handle(viewer, Hello(token=token, client=f"client-{number}"))
        return viewer

    def says(self, viewer: PageConnection) -> str:
        return " ".join(viewer._urgent)

    def give(self, verb: m.Verb, drones: tuple[str, ...] = (), late_ms: float = 0.0) -> str:
        return self.desk.give(verb, drones, Given("viewer 1", late_ms, "r"), self.now_ns)


def order(verb: m.Verb, run: str = RUN, late_ms: float = 0.0, age_ms: float = 0.0, ref: str = "") -> CommandRequest:
    """Return a page's message; late_ms: its age by the server's clock, age_ms: by the page's own count."""
    return CommandRequest(verb, (), run, clock.now_ns() / 1e6 - late_ms, age_ms, ref)


@pytest.mark.parametrize("verb", [m.Verb.HOLD, m.Verb.LAND, m.Verb.CUT_MOTORS])
def test_stops_go_to_the_drones_whatever_else(verb: m.Verb) -> None:
    room = Room()
    assert room.give(verb, late_ms=4900) == ""
    (command,) = room.commands()
    assert (command.verb, command.scope, command.expires_ns, command.header.entity) == (verb, (), 0, "team")


def test_starts_go_to_the_lease_holder_fresh_or_not_at_all() -> None:
    room = Room()
    assert "lease" in room.give(m.Verb.TAKEOFF)
    room.lease()
    assert "too late" in room.give(m.Verb.TAKEOFF, late_ms=2500)
    assert "no drone x" in room.give(m.Verb.TAKEOFF, ("x",))
    assert room.commands() == []
    assert room.give(m.Verb.TAKEOFF, ("drone_2",)) == ""
    (command,) = room.commands()
    assert command.scope == ("operator", "drone_2") and command.expires_ns > 0


def test_the_viewer_who_overrides_the_checks_is_named_in_the_command() -> None:
    room = Room()
    room.lease()
    page = room.viewer(1)
    plain = order(m.Verb.TAKEOFF)
    room.sessions.handle(page, plain)
    room.sessions.handle(page, structs.replace(plain, anyway=True))
    first, second = room.commands()
    assert (first.anyway, first.issuer) == (False, "console")
    assert (second.anyway, second.issuer) == (True, "console (viewer 1)")


@pytest.mark.parametrize("verb", [m.Verb.HOLD, m.Verb.LAND, m.Verb.CUT_MOTORS])
@pytest.mark.parametrize(
    ("bad", "reason"),
    [({"run": "run-0"}, "another run"), ({"late_ms": 5100}, "too late"), ({"age_ms": 5100}, "too late")],
)
def test_a_stop_of_another_run_or_of_long_ago_stops_nobody(verb: m.Verb, bad: dict[str, Any], reason: str) -> None:
    room = Room()
    room.lease()
    viewer = room.viewer(1)
    room.sessions.handle(viewer, order(verb, ref="mine", **bad))
    assert room.commands() == []
    assert reason in room.says(viewer) and '"ref":"mine"' in room.says(viewer)
    # A page that estimates the server's time too late must not prolong its commands' lifetime.
    room.sessions.handle(viewer, order(verb, late_ms=-60_000, age_ms=4900))
    assert [command.verb for command in room.commands()] == [verb]


def test_a_restarted_console_serves_the_same_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run_id("runs/a") == run_id(str(tmp_path / "runs/a"))  # as in the runtime file
    assert run_id("runs/a") != run_id("runs/a-2")


def test_an_order_is_followed_to_its_end() -> None:
    room = Room()
    room.give(m.Verb.LAND)
    (command,) = room.commands()
    assert room.desk.summary()[0]["state"] == "sent"
    room.ack(command, "drone_1", m.AckStage.EFFECTIVE)
    assert room.desk.summary()[0]["state"] == "sent"  # one drone has not answered
    room.ack(command, "drone_2", m.AckStage.RECEIVED)
    assert room.desk.summary()[0]["state"] == "heard"
    room.ack(command, "drone_2", m.AckStage.EFFECTIVE)
    given = room.desk.summary()[0]
    assert given["state"] == "confirmed" and given["ref"] == "r" and given["by"] == "viewer 1" and given["team"]


def test_an_unanswered_command_is_repeated_then_not_confirmed() -> None:
    room = Room()
    room.give(m.Verb.LAND)
    (command,) = room.commands()
    room.desk.step(room.now_ns + NS_PER_S)
    room.desk.step(room.now_ns + NS_PER_S + 1)
    assert [again.id for again in room.commands()] == [command.id]
    room.desk.step(room.now_ns + 25 * NS_PER_S)
    assert room.desk.summary()[0]["state"] == "not_confirmed"
    room.desk.step(room.now_ns + 26 * NS_PER_S)
    assert room.commands() == []


def test_a_refusal_is_shown_with_its_reason() -> None:
    room = Room()
    room.give(m.Verb.HOLD)
    (command,) = room.commands()
    room.ack(command, "drone_1", m.AckStage.EFFECTIVE)
    room.ack(command, "drone_2", m.AckStage.REFUSED, "not flying")
    given = room.desk.summary()[0]
    assert given["state"] == "refused" and given["rows"][1]["reason"] == "not flying"


def test_everybody_s_orders_are_followed_even_if_answers_come_first() -> None:
    room = Room()
    header = room.others.header("team")
    command = m.Command(header=header, id="x", verb=m.Verb.LAND, scope=("drone_1",), issuer="cli_1")
    room.ack(command, "drone_1", m.AckStage.EFFECTIVE)
    room.desk.take(command, room.now_ns)
    room.desk.take(command, room.now_ns)
    (given,) = room.desk.summary()
    assert given["state"] == "confirmed" and given["by"] == "cli_1"
    room.desk.step(room.now_ns + NS_PER_S)
    assert room.commands() == []  # others repeat their own
    for number in range(50):
        again = m.Command(header=header, id=f"{number}", verb=m.Verb.HOLD, scope=(), issuer="tracker")
        room.desk.take(again, room.now_ns)
    assert len(room.desk.summary()) == 2
    for number in range(50):
        other = m.Command(header=header, id=f"{number}-b", verb=m.Verb.HOLD, scope=(), issuer=f"cli_{number}")
        room.desk.take(other, room.now_ns)
    assert len(room.desk.summary()) == 8


def test_an_order_that_is_not_confirmed_says_what_was_done_instead() -> None:
    room = Room()
    header = room.others.header("team")
    command = m.Command(header=header, id="x", verb=m.Verb.TRACK, scope=(), issuer="cli_1")
    room.desk.take(command, room.now_ns)
    room.ack(command, "drone_1", m.AckStage.EFFECTIVE)
    room.ack(command, "drone_2", m.AckStage.ACCEPTED)
    doing = {"drone_1": "tracking for cli_1", "drone_2": "hovers: the tracker sends it no velocity"}
    room.desk.step(room.now_ns, doing)
    assert [row["instead"] for row in room.desk.summary()[0]["rows"]] == ["", ""]
    room.desk.step(room.now_ns + 60 * NS_PER_S, doing)
    room.desk.step(room.now_ns + 61 * NS_PER_S, {"drone_2": "landed"})
    (given,) = room.desk.summary()
    assert given["state"] == "not_confirmed"
    assert [row["instead"] for row in given["rows"]] == ["", "hovers: the tracker sends it no velocity"]


def test_a_stop_is_repeated_until_it_is_heard_whatever_is_ordered_after_it() -> None:
    room = Room()
    room.desk.give(m.Verb.LAND, ("drone_1",), Given("viewer 1", ref="first"), room.now_ns)
    (land,) = room.commands()
    for number in range(20):
        room.desk.give(m.Verb.HOLD, ("drone_2",), Given("viewer 1", ref=f"{number}"), room.now_ns)
        (hold,) = room.commands()
        room.ack(hold, "drone_2", m.AckStage.EFFECTIVE)
        room.desk.step(room.now_ns)
    room.desk.step(room.now_ns + NS_PER_S)
    assert room.commands() == [land] and len(room.desk.summary()) == 8


def test_a_flood_of_orders_that_nobody_hears_is_bounded() -> None:
    room = Room()
    for number in range(100):
        room.desk.give(m.Verb.HOLD, (), Given("viewer 1", ref=f"{number}"), room.now_ns)
    assert len(room.desk.summary()) == 32


def test_an_order_that_a_page_gives_again_after_its_connection_broke_is_one_order() -> None:
    room = Room()
    page = room.viewer(1)
    room.sessions.handle(page, order(m.Verb.LAND, ref="page-1"))
    room.sessions.handle(page, order(m.Verb.LAND, ref="page-1", age_ms=2000.0))
    room.sessions.handle(page, order(m.Verb.LAND, ref="page-2"))
    assert len(room.commands()) == 2 and "order" not in room.sessions.refused


def test_without_the_token_a_page_only_looks() -> None:
    room = Room()
    room.lease()
    stranger = room.viewer(1, token="guess")
    for message in (order(m.Verb.LAND), TakeOver(), Place(0.0, 0.0)):
        room.sessions.handle(stranger, message)
    assert room.commands() == [] and room.steering.drain() == []
    assert room.sessions.operator_lock.client == ""
    assert room.sessions.refused == {"token": 1, "untrusted": 3}
    room.sessions.handle(stranger, Watch(("ceiling",)))
    assert stranger.watched == {"ceiling"}


def test_one_operator_at_a_time_and_anybody_may_stop() -> None:
    room = Room()
    room.lease()
    first, second = room.viewer(1), room.viewer(2)
    room.sessions.handle(first, order(m.Verb.TRACK))
    room.sessions.handle(second, order(m.Verb.TRACK, ref="mine"))
    room.sessions.handle(second, order(m.Verb.LAND))
    assert [command.verb for command in room.commands()] == [m.Verb.TRACK, m.Verb.LAND]
    assert "viewer 1 is the operator" in room.says(second) and '"ref":"mine"' in room.says(second)
    room.sessions.handle(second, TakeOver())
    told = room.sessions.summary(room.now_ns)
    assert told["operator"] == "viewer 2" and "client" not in f"{told}", "whoever knew that id would be the operator"
    assert "viewer 2 has taken over from viewer 1" in room.says(first)
    room.sessions.handle(second, Release())
    assert room.sessions.summary(room.now_ns)["operator"] == ""


def test_the_lock_waits_for_a_page_that_reconnects() -> None:
    lock = OperatorLock()
    lock.take("a", "viewer 1")
    lock.left("a", NS_PER_S)
    lock.step(10 * NS_PER_S)
    assert not lock.may_start("b")
    lock.arrived("a", "viewer 2")
    lock.step(100 * NS_PER_S)
    assert lock.name == "viewer 2"
    lock.left("a", 100 * NS_PER_S)
    lock.step(116 * NS_PER_S)
    assert lock.may_start("b")


def test_only_a_simulated_target_is_steered() -> None:
    room = Room()
    viewer = room.viewer(1)
    for message in (Drive(0.3, -0.5), Place(1.0, -2.0), FollowPath()):
        room.sessions.handle(viewer, message)
    actions = [item.message.action for item in room.steering.drain()]  # type: ignore[union-attr]
    assert actions == ["drive", "place", "path"]
    other = room.viewer(2)
    for message in (Drive(0.3, -0.5), Place(1.0, -2.0), FollowPath()):
        room.sessions.handle(other, message)
    assert room.steering.drain() == [] and room.sessions.refused == {"not_operator": 3}, "the first who asked steers"
    assert "viewer 1 is the operator: take over first" in room.says(other)
    several = Room(targets=("one", "other"))
    for steered in (Place(0.0, 0.0), Place(1.0, 1.0, target="other"), Place(1.0, 1.0, target="drone_1")):
        several.sessions.handle(several.viewer(1), steered)
    assert [item.key.entity for item in several.steering.drain()] == ["one", "other"]
    assert several.sessions.refused == {"unknown_target": 1}
    real = Room(targets=())
    real.sessions.handle(real.viewer(1), Place(1.0, 1.0))
    assert real.steering.drain() == [] and real.sessions.refused == {"not_simulated": 1}


def test_viewers_that_lag_are_spared(monkeypatch: pytest.MonkeyPatch) -> None:
    room = Room()
    viewer = room.viewer(1)
    room.sessions.handle(viewer, FramesHandled(10**9))  # a viewer cannot have shown frames that were not sent
    assert viewer._seen == 0
    for number in range(70):
        viewer.say(f"{number}")
    assert viewer.too_slow
    allowed = sum(viewer.may_speak() for _ in range(1000))
    assert 120 <= allowed < 200
