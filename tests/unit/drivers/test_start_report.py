"""One process with several vehicles has one lifecycle, which changes only with what they report."""

from typing import Any

from drivers.start_report import StartReport


class Process:
    def __init__(self) -> None:
        self.states: list[str] = []
        self.works = False

    def ready(self, detail: str = "") -> None:
        self.states.append(f"READY {detail}")

    def degrade(self, detail: str, works: bool = True) -> None:
        self.states.append(f"DEGRADED {detail}")
        self.works = works


def report_of(*names: str) -> tuple[Process, StartReport]:
    process: Any = Process()
    return process, StartReport(process, names)


def test_vehicles_that_are_ready_at_each_turn_are_told_once() -> None:
    process, start = report_of("a", "b")
    for _ in range(100):
        start.ready("a", "a at x", flies=False)
        start.ready("b", "b at x", flies=False)
    assert process.states == ["READY a at x; b at x"]


def test_what_one_lacks_is_told_while_the_other_is_ready() -> None:
    process, start = report_of("a", "b")
    start.ready("a", "a at x", flies=False)
    assert process.states == [], "the start goes on"
    start.degrade("b", "b does not answer at x")
    for _ in range(100):
        start.ready("a", "a at x", flies=False)
    assert process.states == ["DEGRADED b does not answer at x"]
    start.ready("b", "b at x", flies=False)
    assert process.states[1:] == ["READY a at x; b at x"]


def test_a_flying_vehicle_does_not_wait_for_the_others() -> None:
    process, start = report_of("a", "b")
    start.ready("a", "a at x", flies=True)
    assert process.states == ["DEGRADED b has not answered yet"]


def test_a_single_vehicle_is_ready_or_not() -> None:
    process, start = report_of("a")
    start.degrade("a", "a does not answer")
    start.ready("a", "a at x", flies=False)
    assert process.states == ["DEGRADED a does not answer", "READY a at x"]


def test_a_process_works_only_once_it_has_heard_all_its_vehicles() -> None:
    """Whoever sends to a vehicle after its driver's death goes on until the new driver has heard it."""
    process, start = report_of("a", "b")
    start.degrade("a", "a does not answer", heard=False)
    assert not process.works
    start.degrade("b", "b: its battery is low")
    assert not process.works
    start.degrade("a", "a: its battery is low")
    assert process.works
