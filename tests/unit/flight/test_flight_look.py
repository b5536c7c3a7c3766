"""Interrupted pre-flight checks: no take-off after Ctrl-C, a dead process, or in a run that only checks."""

import time
from types import SimpleNamespace
from typing import cast

import pytest

from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.cli.exits import ExitCode
from groundstation.cli.run import _exit_code
from groundstation.field.resolved import ResolvedField
from groundstation.flight import loop
from groundstation.flight.flight_plan import FlightPlan
from groundstation.runtime.take_off import TakeOffLimits
from groundstation.supervisor.start import Start
from groundstation.supervisor.supervisor import Supervisor
from groundstation.supervisor.terminal import Terminal


class Unfinished:
    """Checks that never end and have no findings so far."""

    def __init__(self, _bus: object, _field: object, _cautions: object) -> None:
        pass

    def update(self, now_ns: int) -> None:
        pass

    def complete(self, _now_ns: int) -> bool:
        return False

    def forbids(self, _now_ns: int, _drones: object) -> list[object]:
        return []


class Silent(Unfinished):
    """Checks that see everything and receive no drone's telemetry."""

    def complete(self, _now_ns: int) -> bool:
        return True

    def findings(self, _now_ns: int) -> list[object]:
        return []

    def left_out(self, _now_ns: int) -> tuple[str, ...]:
        return ("drone_1",)

    def publish(self, _findings: object, _now_ns: int) -> None:
        pass


class Broken:
    """A run whose drone is ready on the ground, and that ends in the third turn of the checks."""

    def __init__(self, failure: str, state: m.FlightState = m.FlightState.LANDED) -> None:
        exchange = MemoryExchange()
        self.bus, self._drone = MemoryBus(exchange, "lab", "supervisor"), MemoryBus(exchange, "lab", "drone_1")
        self._orders = self._drone.subscribe([t.COMMAND])
        self.run = SimpleNamespace(drones=("drone_1",))
        self.interrupts = SimpleNamespace(stop_requested=False, hurry=False)
        self.failure, self.unwell, self._why = "", list[str](), failure
        self.processes = ()
        self._turns, self._state = 0, state

    def step(self) -> None:
        self._turns += 1
        status = m.VehicleStatus(header=self._drone.header("drone_1"), flight_state=self._state, mode="")
        self._drone.publish(t.VEHICLE_STATUS, status)
        if self._turns == 3:
            self.failure, self.interrupts.stop_requested = self._why, not self._why
        time.sleep(0.002)

    def end_run(self) -> None:
        pass

    def heard(self) -> list[m.Verb]:
        return [r.message.verb for r in self._orders.drain() if isinstance(r.message, m.Command)]


def plan_of(field: ResolvedField, *, look_only: bool) -> FlightPlan:
    return FlightPlan(
        None,
        asks=False,
        cameras={},
        limits=TakeOffLimits(),
        landing_limit_s=0.1,
        field=field,
        look_only=look_only,
    )


@pytest.mark.parametrize("look_only", [False, True])
@pytest.mark.parametrize("failure", ["", "the router died"])
def test_a_look_that_is_broken_off_is_followed_by_no_take_off(
    failure: str, look_only: bool, lab_field: ResolvedField, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loop, "BeforeTakeOff", Unfinished)
    run = Broken(failure)
    terminal = cast(Terminal, SimpleNamespace(say=lambda _: None, unmute=lambda: None))
    flight = loop.Flight(cast(Supervisor, run), plan_of(lab_field, look_only=look_only), terminal)
    flight._start = cast(Start, SimpleNamespace(run=lambda: None, show_screen=lambda: None))
    outcome = flight.run()
    assert m.Verb.TAKEOFF not in run.heard()
    assert (outcome.failure, outcome.interrupted, outcome.landed) == (failure, not failure, True)


@pytest.mark.parametrize(
    ("forbidden", "interrupted", "code"),
    [(False, False, ExitCode.OK), (True, False, ExitCode.FAILED), (False, True, ExitCode.INTERRUPTED)],
)
def test_a_look_that_was_broken_off_does_not_say_that_all_is_well(
    forbidden: bool, interrupted: bool, code: ExitCode, lab_field: ResolvedField
) -> None:
    outcome = loop.FlightOutcome("", interrupted, landed=True, forbidden=forbidden)
    assert _exit_code(outcome, plan_of(lab_field, look_only=True), None, judged_by_landing=False) is code


@pytest.mark.parametrize(
    ("landed", "interrupted", "code"),
    [
        (True, True, ExitCode.OK),
        (False, True, ExitCode.FAILED),
        (None, True, ExitCode.INTERRUPTED),
        (None, False, ExitCode.FAILED),
    ],
)
def test_the_exit_code_says_no_more_of_landings_than_is_known(
    landed: bool | None, interrupted: bool, code: ExitCode, lab_field: ResolvedField
) -> None:
    outcome = loop.FlightOutcome("", interrupted, landed=landed)
    assert _exit_code(outcome, plan_of(lab_field, look_only=False), None, judged_by_landing=True) is code


def test_a_mere_look_by_which_nobody_would_take_off_is_not_well(
    lab_field: ResolvedField, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loop, "BeforeTakeOff", Silent)
    said: list[str] = []
    terminal = cast(Terminal, SimpleNamespace(say=said.append, unmute=lambda: None))
    flight = loop.Flight(cast(Supervisor, Broken("it took too long")), plan_of(lab_field, look_only=True), terminal)
    flight._start = cast(Start, SimpleNamespace(run=lambda: None, show_screen=lambda: None))
    assert flight.run().forbidden and said[-1].endswith("nothing must be mended; nobody would take off")


def test_a_mere_look_at_a_flying_drone_does_not_call_it_landed(
    lab_field: ResolvedField, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loop, "BeforeTakeOff", Silent)
    terminal = cast(Terminal, SimpleNamespace(say=lambda _: None, unmute=lambda: None))
    run = Broken("it took too long", m.FlightState.FLYING)
    flight = loop.Flight(cast(Supervisor, run), plan_of(lab_field, look_only=True), terminal)
    flight._start = cast(Start, SimpleNamespace(run=lambda: None, show_screen=lambda: None))
    assert flight.run().landed is False
