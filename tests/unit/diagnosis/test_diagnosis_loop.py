"""The loop of the diagnosis: what it takes in, when it judges, and what it says."""

import time
from typing import cast

import pytest
from swinging_lab import Lab

from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import FlightState, Header, Message, Suspicion, VehicleStatus
from groundstation.bus.topics import OBSERVATION, ODOMETRY, SUSPICION, VEHICLE_STATUS
from groundstation.diagnosis.loop import PAUSE_NS, Diagnosis
from groundstation.diagnosis.window import Window
from groundstation.field.resolved import ResolvedField
from groundstation.process.child import Child
from sim_bridge.study.wrong_figures import WrongFigures

TOPIC_OF = {"status": VEHICLE_STATUS, "odometry": ODOMETRY, "observation": OBSERVATION}
S = 1_000_000_000


class FakeChild:
    """Notes what the diagnosis says."""

    name = "diagnosis"

    def __init__(self, bus: MemoryBus) -> None:
        self.bus = bus
        self.events: list[tuple[str, str]] = []

    def event(self, severity: str, text: str, remedy: str = "", entity: str | None = None) -> None:
        self.events.append((str(severity), text))


def status(at_s: float, state: FlightState, clock_id: str = "c") -> Message:
    return VehicleStatus(header=Header(round(at_s * S), clock_id, "drone_1", "d", 1), flight_state=state, mode="TRACK")


def test_only_a_flight_of_some_seconds_is_judged_and_its_last_forty() -> None:
    window = Window("c")
    assert window.flown() is None
    for second in range(6):
        window.take("k", status(second, FlightState.FLYING), second * S)
    assert window.flown() is None, "too short"
    for second in range(6, 100):
        window.take("k", status(second, FlightState.FLYING), second * S)
    flown = window.flown()
    assert flown is not None and flown.duration_s == 40.0
    window.take("k", status(100, FlightState.LANDED), 100 * S)
    assert window.flown() is None, "nobody flies"


def test_what_another_clock_stamped_tells_nothing() -> None:
    window = Window("c")
    for second in range(20):
        window.take("k", status(second, FlightState.FLYING, "elsewhere"), second * S)
    assert window.flown() is None


def test_a_wrong_figure_is_told_to_operator_and_tracker(
    lab_field: ResolvedField, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clock, "clock_id", lambda: "c")
    exchange = MemoryExchange()
    child = FakeChild(MemoryBus(exchange, "lab", "diagnosis"))
    heard = MemoryBus(exchange, "lab", "tracker").subscribe([SUSPICION])
    buses = {name: MemoryBus(exchange, "lab", name) for name in ("ceiling", *lab_field.drones)}
    diagnosis = Diagnosis(cast("Child", child), lab_field)
    now_ns = 0
    for now_ns, inputs in Lab(lab_field, WrongFigures({("drone_1", "delay"): 60.0})).flown().ticks:
        for kind, message in inputs:
            buses[message.header.source].publish(TOPIC_OF[kind], message)
        diagnosis.turn(now_ns)
    for _ in range(200):
        time.sleep(0.1)
        now_ns += PAUSE_NS
        diagnosis.turn(now_ns)
        if child.events:
            break
    (severity, text), *_ = child.events
    assert severity == "WARNING" and "the pictures of drone_1's camera are" in text
    causes = [one.message.cause for one in heard.drain() if isinstance(one.message, Suspicion)]
    assert "the pictures of drone_1's camera are" in causes[-1]
