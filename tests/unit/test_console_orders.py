"""Orders of the page on the bus, who may give them, and how far they came."""

import pytest

from groundstation.bus import clock
from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.console.board import Board
from groundstation.console.helm import Helm
from groundstation.console.orders import OrderDesk
from groundstation.console.protocol import Drive, FollowPath, Hello, Order, Place, Release, Seen, TakeOver, Watch
from groundstation.console.session import Sessions
from groundstation.console.viewer import Viewer

DRONES = ("drone_1", "drone_2")
NS = 1_000_000_000


class Room:
    def __init__(self, targets: tuple[str, ...] = ("turtlebot",)) -> None:
        exchange = MemoryExchange()
        self.bus = MemoryBus(exchange, "lab", "console")
        self.others = MemoryBus(exchange, "lab", "drone_1")
        self.heard = self.others.subscribe([t.COMMAND])
        self.steering = self.others.subscribe([t.SIM_COMMAND])
        self.desk = OrderDesk(self.bus, DRONES)
        self.sessions = Sessions(self.bus, self.desk, "secret", targets)
        self.now_ns = clock.now_ns()

    def lease(self) -> None:
        header = self.bus.header("team")
        self.desk.hear_lease(m.Lease(header=header, holder="operator", expires_ns=header.stamp_ns + 60 * NS))

    def commands(self) -> list[m.Command]:
        return [item.message for item in self.heard.drain() if isinstance(item.message, m.Command)]

    def ack(self, command: m.Command, entity: str, stage: m.AckStage, reason: str = "") -> None:
        header = m.Header(1, "c", entity, entity, 0)
        ack = m.CommandAck(header=header, command_id=command.id, verb=command.verb, stage=stage, reason=reason)
        self.desk.hear(ack, self.now_ns)

    def viewer(self, number: int, token: str = "secret") -> Viewer:
        async def nothing(_: object) -> None:
            return None

        viewer = Viewer(number, Board(), nothing, nothing)
        self.sessions.add(viewer)
        self.sessions.handle(viewer, Hello(token=token, client=f"client-{number}"))
        return viewer

    def says(self, viewer: Viewer) -> str:
        return " ".join(viewer._urgent)

    def give(self, verb: m.Verb, drones: tuple[str, ...] = (), late_ms: float = 0.0) -> str:
        return self.desk.give(verb, drones, "viewer 1", self.now_ns / 1e6 - late_ms, "r", self.now_ns)


@pytest.mark.parametrize("verb", [m.Verb.HOLD, m.Verb.LAND, m.Verb.CUT_MOTORS])
def test_stops_go_to_the_drones_whatever_else(verb: m.Verb) -> None:
    room = Room()
    assert room.give(verb, late_ms=1e9) == ""
    (command,) = room.commands()
    assert (command.verb, command.scope, command.expires_ns, command.header.entity) == (verb, (), 0, "team")


def test_starts_go_to_the_lease_holder_fresh_or_not_at_all() -> None:
    room = Room()
    assert "lease" in room.give(m.Verb.TAKEOFF)
    room.lease()
    assert "too late" in room.give(m.Verb.TAKEOFF, late_ms=2500)
    assert "too late" in room.desk.give(m.Verb.TRACK, (), "v", float("nan"), "", room.now_ns)
    assert "no drone x" in room.give(m.Verb.TAKEOFF, ("x",))
    assert room.commands() == []
    assert room.give(m.Verb.TAKEOFF, ("drone_2",)) == ""
    (command,) = room.commands()
    assert command.scope == ("operator", "drone_2") and command.expires_ns > 0


def test_an_order_is_followed_to_its_end() -> None:
    room = Room()
    room.give(m.Verb.LAND)
    (command,) = room.commands()
    assert room.desk.summary()[0]["state"] == "sent"
    room.ack(command, "drone_1", m.AckStage.EFFECTIVE)
    assert room.desk.summary()[0]["state"] == "sent"  # one drone has said nothing
    room.ack(command, "drone_2", m.AckStage.RECEIVED)
    assert room.desk.summary()[0]["state"] == "heard"
    room.ack(command, "drone_2", m.AckStage.EFFECTIVE)
    order = room.desk.summary()[0]
    assert order["state"] == "confirmed" and order["ref"] == "r" and order["by"] == "viewer 1" and order["team"]


def test_what_is_not_heard_is_repeated_and_in_the_end_not_confirmed() -> None:
    room = Room()
    room.give(m.Verb.LAND)
    (command,) = room.commands()
    room.desk.step(room.now_ns + NS)
    room.desk.step(room.now_ns + NS + 1)
    assert [again.id for again in room.commands()] == [command.id]
    room.desk.step(room.now_ns + 25 * NS)
    assert room.desk.summary()[0]["state"] == "not_confirmed"
    room.desk.step(room.now_ns + 26 * NS)
    assert room.commands() == []


def test_a_refusal_is_shown_with_its_reason() -> None:
    room = Room()
    room.give(m.Verb.HOLD)
    (command,) = room.commands()
    room.ack(command, "drone_1", m.AckStage.EFFECTIVE)
    room.ack(command, "drone_2", m.AckStage.REFUSED, "not flying")
    order = room.desk.summary()[0]
    assert order["state"] == "refused" and order["rows"][1]["reason"] == "not flying"


def test_everybody_s_orders_are_followed_even_if_answers_come_first() -> None:
    room = Room()
    header = room.others.header("team")
    command = m.Command(header=header, id="x", verb=m.Verb.LAND, scope=("drone_1",), issuer="cli_1")
    room.ack(command, "drone_1", m.AckStage.EFFECTIVE)
    room.desk.hear(command, room.now_ns)
    room.desk.hear(command, room.now_ns)
    (order,) = room.desk.summary()
    assert order["state"] == "confirmed" and order["by"] == "cli_1"
    room.desk.step(room.now_ns + NS)
    assert room.commands() == []  # others repeat their own
    for number in range(50):
        again = m.Command(header=header, id=f"{number}", verb=m.Verb.HOLD, scope=(), issuer="tracker")
        room.desk.hear(again, room.now_ns)
    assert len(room.desk.summary()) == 2
    for number in range(50):
        other = m.Command(header=header, id=f"{number}-b", verb=m.Verb.HOLD, scope=(), issuer=f"cli_{number}")
        room.desk.hear(other, room.now_ns)
    assert len(room.desk.summary()) == 8


def test_without_the_token_a_page_only_looks() -> None:
    room = Room()
    room.lease()
    stranger = room.viewer(1, token="guess")
    for message in (Order(m.Verb.LAND, (), 0.0), TakeOver(), Place(0.0, 0.0)):
        room.sessions.handle(stranger, message)
    assert room.commands() == [] and room.steering.drain() == []
    assert room.sessions.helm.client == ""
    assert room.sessions.refused == {"token": 1, "untrusted": 3}
    room.sessions.handle(stranger, Watch(("ceiling",)))
    assert stranger.watched == {"ceiling"}


def test_one_operator_at_a_time_and_anybody_may_stop() -> None:
    room = Room()
    room.lease()
    first, second = room.viewer(1), room.viewer(2)
    now_ms = room.now_ns / 1e6
    room.sessions.handle(first, Order(m.Verb.TRACK, (), now_ms))
    room.sessions.handle(second, Order(m.Verb.TRACK, (), now_ms, "mine"))
    room.sessions.handle(second, Order(m.Verb.LAND, (), now_ms))
    assert [command.verb for command in room.commands()] == [m.Verb.TRACK, m.Verb.LAND]
    assert "viewer 1 is the operator" in room.says(second) and '"ref":"mine"' in room.says(second)
    room.sessions.handle(second, TakeOver())
    assert room.sessions.summary(room.now_ns)["operator"] == "client-2"
    assert "viewer 2 has taken over from viewer 1" in room.says(first)
    room.sessions.handle(second, Release())
    assert room.sessions.summary(room.now_ns)["operator"] == ""


def test_the_helm_waits_for_a_page_that_reconnects() -> None:
    helm = Helm()
    helm.take("a", "viewer 1")
    helm.left("a", NS)
    helm.step(10 * NS)
    assert not helm.may_start("b")
    helm.arrived("a", "viewer 2")
    helm.step(100 * NS)
    assert helm.name == "viewer 2"
    helm.left("a", 100 * NS)
    helm.step(116 * NS)
    assert helm.may_start("b")


def test_only_a_simulated_target_is_steered() -> None:
    room = Room()
    viewer = room.viewer(1)
    for message in (Drive(0.3, -0.5), Place(1.0, -2.0), FollowPath()):
        room.sessions.handle(viewer, message)
    actions = [item.message.action for item in room.steering.drain()]  # type: ignore[union-attr]
    assert actions == ["drive", "place", "path"]
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
    room.sessions.handle(viewer, Seen(10**9))  # nobody has seen what was not sent
    assert viewer._seen == 0
    for number in range(70):
        viewer.say(f"{number}")
    assert viewer.too_slow
    allowed = sum(viewer.may_speak() for _ in range(1000))
    assert 120 <= allowed < 200
