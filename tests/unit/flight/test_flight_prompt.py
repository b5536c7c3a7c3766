"""Keys before a take-off: the prompt stays, and a flight without confirmation does not take off after a stop."""

import os
import pty
import time
from collections.abc import Iterator
from types import SimpleNamespace
from typing import NamedTuple, cast

import pytest

from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.flight import loop
from groundstation.flight.flight_plan import FlightPlan
from groundstation.flight.keyboard import Keyboard
from groundstation.process.sleep_watch import SleepWatch
from groundstation.runtime.operator import Operator
from groundstation.runtime.take_off import TakeOffLimits
from groundstation.runtime.team import TeamPhase
from groundstation.supervisor.start import Start
from groundstation.supervisor.supervisor import Supervisor
from groundstation.supervisor.terminal import Terminal

_LONGEST_S = 2.0


class Ends(NamedTuple):
    """The two ends of a keyboard: the run's input, and the test's output (descriptors)."""

    read: int
    typed: int


class Waiting:
    """A run whose drone is on the ground; a page presses a button at the first turn, the keyboard Enter at turn 5."""

    def __init__(self, keyboard: Ends, pressed: m.Verb, typed: bytes = b"\n") -> None:
        exchange = MemoryExchange()
        self.bus, self._drone = MemoryBus(exchange, "lab", "supervisor"), MemoryBus(exchange, "lab", "drone_1")
        self._page = MemoryBus(exchange, "lab", "console")
        self._orders = self._drone.subscribe([t.COMMAND])
        self.run = SimpleNamespace(drones=("drone_1",))
        self.interrupts = SimpleNamespace(stop_requested=False, hurry=False)
        self.failure, self.unwell, self.processes = "", list[str](), tuple[object, ...]()
        self.said: list[str] = []
        self.heard: list[m.Verb] = []
        self._pressed, self._typed = pressed, typed
        self.keyboard, self._turns, self._began = keyboard, 0, time.monotonic()

    def step(self) -> None:
        self._turns += 1
        status = m.VehicleStatus(header=self._drone.header("drone_1"), flight_state=m.FlightState.LANDED, mode="LANDED")
        self._drone.publish(t.VEHICLE_STATUS, status)
        self.heard += [r.message.verb for r in self._orders.drain() if isinstance(r.message, m.Command)]
        if self._turns == 1:
            header = self._page.header("team")
            scope = () if self._pressed.stops else (m.OPERATOR,)
            order = m.Command(header=header, id="page-1", verb=self._pressed, scope=scope, issuer="console")
            self._page.publish(t.COMMAND, order)
        if self._turns == 5:
            os.write(self.keyboard.typed, self._typed)
        late = time.monotonic() - self._began > _LONGEST_S
        self.interrupts.stop_requested = late or m.Verb.TAKEOFF in self.heard
        time.sleep(0.002)

    def end_run(self) -> None:
        pass


@pytest.fixture
def keyboard() -> Iterator[Ends]:
    yield from closed_after(Ends(*os.pipe()))


@pytest.fixture
def terminal() -> Iterator[Ends]:
    operator, run = pty.openpty()
    yield from closed_after(Ends(run, operator))


def closed_after(ends: Ends) -> Iterator[Ends]:
    yield ends
    os.close(ends.read)
    os.close(ends.typed)


def flown(waiting: Waiting, *, asks: bool) -> loop.FlightOutcome:
    return flight_of(waiting, asks=asks).run()


def flight_of(waiting: Waiting, *, asks: bool) -> loop.Flight:
    terminal = cast(Terminal, SimpleNamespace(say=waiting.said.append, unmute=lambda: None))
    plan = FlightPlan(None, asks=asks, cameras={}, limits=TakeOffLimits(unseen_s=10.0), landing_limit_s=0.1)
    flight = loop.Flight(cast(Supervisor, waiting), plan, terminal, Keyboard(waiting.keyboard.read))
    flight._start = cast(Start, SimpleNamespace(run=lambda: None, show_screen=lambda: None))
    return flight


def test_hold_before_the_take_off_ends_neither_the_prompt_nor_a_flight_that_was_none(keyboard: Ends) -> None:
    waiting = Waiting(keyboard, m.Verb.HOLD)
    flown(waiting, asks=True)
    assert m.Verb.TAKEOFF in waiting.heard, "Enter takes off after HOLD as before it"
    assert any("HOLD by console" in line for line in waiting.said)
    assert not any("without an order to all" in line for line in waiting.said)


@pytest.mark.parametrize("stop", [m.Verb.HOLD, m.Verb.LAND, m.Verb.CUT_MOTORS])
def test_a_run_that_asks_nobody_does_not_take_off_after_a_stop(keyboard: Ends, stop: m.Verb) -> None:
    waiting = Waiting(keyboard, stop)
    outcome = flown(waiting, asks=False)
    assert outcome.failure == f"nobody took off: {stop} by console came after it"
    assert m.Verb.TAKEOFF not in waiting.heard


@pytest.mark.parametrize("role", ["driver", "camera"])
def test_a_driver_that_somebody_signalled_counts_as_a_stop(keyboard: Ends, role: str) -> None:
    waiting = Waiting(keyboard, m.Verb.HOLD, typed=b"")
    ends = iter([False, True])
    spec = SimpleNamespace(name="drone_1", role=role)
    waiting.processes = (SimpleNamespace(spec=spec, left_when_told=lambda: next(ends, False)),)
    flown(waiting, asks=True)
    assert any("drone_1's driver was told by a signal to land" in line for line in waiting.said) is (role == "driver")


@pytest.mark.parametrize("start", [m.Verb.TRACK, m.Verb.RESUME])
def test_a_start_that_nobody_can_obey_before_take_off_does_not_end_the_prompt(keyboard: Ends, start: m.Verb) -> None:
    waiting = Waiting(keyboard, start)
    flown(waiting, asks=True)
    assert m.Verb.TAKEOFF in waiting.heard, "Enter takes off after it as before it"
    assert not any("without an order to all" in line for line in waiting.said)


def test_enter_pressed_before_it_is_asked_for_takes_nobody_off(terminal: Ends) -> None:
    os.write(terminal.typed, b"\n")  # while the processes start
    waiting = Waiting(terminal, m.Verb.HOLD, typed=b"")
    flown(waiting, asks=True)
    assert m.Verb.TAKEOFF not in waiting.heard


def test_enter_in_a_terminal_takes_off(terminal: Ends) -> None:
    waiting = Waiting(terminal, m.Verb.HOLD)
    flown(waiting, asks=True)
    assert m.Verb.TAKEOFF in waiting.heard


@pytest.mark.parametrize("typed", [b"exit\n", b"groundstation land\n", b"no"])
def test_no_other_word_takes_off(keyboard: Ends, typed: bytes) -> None:
    waiting = Waiting(keyboard, m.Verb.HOLD, typed)
    flown(waiting, asks=True)
    assert m.Verb.TAKEOFF not in waiting.heard
    assert any("press Enter alone" in line for line in waiting.said) == typed.endswith(b"\n")


@pytest.mark.parametrize("typed", [b"anyway\n", b"\r\n", b" \n"])
def test_enter_and_anyway_take_off(keyboard: Ends, typed: bytes) -> None:
    waiting = Waiting(keyboard, m.Verb.HOLD, typed)
    flown(waiting, asks=True)
    assert m.Verb.TAKEOFF in waiting.heard


def test_a_keyboard_that_is_another_programs_is_left_alone(monkeypatch: pytest.MonkeyPatch, keyboard: Ends) -> None:
    waiting = Waiting(keyboard, m.Verb.HOLD)
    monkeypatch.setattr(os, "read", refused)
    flown(waiting, asks=True)
    assert m.Verb.TAKEOFF not in waiting.heard
    assert not any("no keyboard" in line for line in waiting.said)


def refused(*_: object) -> bytes:
    raise OSError(5, "Input/output error")


@pytest.mark.parametrize("asks", [True, False], ids=["real", "emulated"])
def test_a_computer_that_slept_in_flight_lands_real_drones(keyboard: Ends, asks: bool) -> None:
    waiting = Waiting(keyboard, m.Verb.HOLD, typed=b"")
    flight = flight_of(waiting, asks=asks)
    flight._sleep = cast(SleepWatch, SimpleNamespace(slept_s=lambda: 12.3))
    operator = cast(Operator, SimpleNamespace(phase=TeamPhase.TRACKING, landed=lambda _now_ns: False, forbidden="",
                                              step=lambda _now_ns: None, take_off=lambda *_, **__: None,
                                              mistake=None, tracking_since_ns=0))  # fmt: skip
    assert ("slept for 12 s in flight" in flight._fly(operator)) == asks


def test_drones_landed_singly_are_not_reported_as_landed_by_themselves() -> None:
    said: list[str] = []
    terminal = cast(Terminal, SimpleNamespace(say=said.append))
    flight = loop.Flight(cast(Supervisor, SimpleNamespace()), cast(FlightPlan, None), terminal)
    operator = cast(Operator, SimpleNamespace(phase=TeamPhase.TRACKING, landed=lambda _now_ns: True))
    for now_ns in (1, 2):
        flight._tell_grounded(operator, now_ns)
    (line,) = said
    assert "all drones have landed without an order to all" in line and "groundstation takeoff" in line
