"""Two consoles of one run: both show the sender of the last start as the operator."""

from collections.abc import Iterator

import pytest

from groundstation.bus import clock
from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.console.protocol import CommandRequest, Hello, Release, TakeOver
from groundstation.console.room import bare_scene
from groundstation.console.server import ConsoleServer, claim_port
from groundstation.console.snapshot import Snapshot
from groundstation.console.viewer import PageConnection
from groundstation.monitor.state import Cast
from groundstation.time_units import NS_PER_S

RUN = "run-1"


class Console:
    """A console run step by step, with one page."""

    def __init__(self, exchange: MemoryExchange, source: str) -> None:
        scene = bare_scene("lab", ("drone_1",), False)
        bus = MemoryBus(exchange, "lab", source)
        listener = claim_port(38785)
        self.server = ConsoleServer(bus, Cast("lab", {"drone_1": 0.15}, ()), scene, None, listener, RUN)
        self.close = listener.close
        self.page = PageConnection(1, Snapshot(), _nothing, _nothing)
        self.server.sessions.add(self.page)
        token = self.server.sessions._token
        self.server.sessions.handle(self.page, Hello(token=token, client=f"client of {source}"))

    def turn(self) -> None:
        self.server.turn(clock.now_ns())

    def order(self, verb: m.Verb) -> None:
        self.server.sessions.handle(self.page, CommandRequest(verb, (), RUN, clock.now_ns() / 1e6, 0.0, ""))

    @property
    def operator(self) -> str:
        return str(self.server.sessions.summary(clock.now_ns())["operator"])

    @property
    def told(self) -> str:
        return " ".join(self.page._urgent)


async def _nothing(_: object) -> None:
    return None


class Run:
    """The run's own console and one of another shell, with a lease holder."""

    def __init__(self) -> None:
        exchange = MemoryExchange()
        self.own, self.other = Console(exchange, "console"), Console(exchange, "console_laptop_77")
        drone = MemoryBus(exchange, "lab", "drone_1")
        self._commands = drone.subscribe([t.COMMAND])
        supervisor = MemoryBus(exchange, "lab", "supervisor")
        header = supervisor.header("team")
        lease = m.Lease(header=header, holder="operator", expires_ns=header.stamp_ns + 60 * NS_PER_S, run="")
        supervisor.publish(t.LEASE, lease)
        self.turn()

    def turn(self) -> None:
        self.own.turn()
        self.other.turn()

    def heard(self) -> list[m.Verb]:
        return [one.message.verb for one in self._commands.drain() if isinstance(one.message, m.Command)]


@pytest.fixture
def run() -> Iterator[Run]:
    made = Run()
    yield made
    made.own.close()
    made.other.close()


def test_the_operator_of_one_console_is_shown_at_the_other(run: Run) -> None:
    run.own.order(m.Verb.TRACK)
    run.turn()
    assert (run.own.operator, run.other.operator) == ("viewer 1", "console")
    run.other.order(m.Verb.RESUME)
    assert "console is the operator: take over first" in run.other.told
    assert run.heard() == [m.Verb.TRACK]


def test_a_takeover_at_another_console_takes_effect_with_its_next_start(run: Run) -> None:
    run.own.order(m.Verb.TRACK)
    run.turn()
    run.other.server.sessions.handle(run.other.page, TakeOver())
    run.other.order(m.Verb.RESUME)
    run.turn()
    assert run.heard() == [m.Verb.TRACK, m.Verb.RESUME]
    assert (run.own.operator, run.other.operator) == ("console_laptop_77", "viewer 1")
    assert "RESUME was given at console_laptop_77, another console" in run.own.told
    run.own.order(m.Verb.TRACK)
    assert run.heard() == []


def test_a_start_that_is_repeated_takes_nothing_back(run: Run) -> None:
    run.own.order(m.Verb.TRACK)
    run.turn()
    run.other.server.sessions.handle(run.other.page, TakeOver())
    (order,) = (followed.book.command for followed in run.own.server.sessions.desk._orders.values())
    run.own.server._bus.publish(t.COMMAND, order)
    run.turn()
    assert run.other.operator == "viewer 1"


def test_anybody_may_stop_and_a_stop_makes_nobody_the_operator(run: Run) -> None:
    run.own.order(m.Verb.TRACK)
    run.turn()
    run.other.order(m.Verb.LAND)
    run.turn()
    assert run.heard() == [m.Verb.TRACK, m.Verb.LAND]
    assert run.own.operator == "viewer 1"


def test_a_page_cannot_release_what_another_console_has(run: Run) -> None:
    run.own.order(m.Verb.TRACK)
    run.turn()
    run.other.server.sessions.handle(run.other.page, Release())
    assert run.other.operator == "console"
