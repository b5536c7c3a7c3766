"""The diagnosis process forwards the operator's notices, and ends on request."""

from typing import Any, cast

import msgspec
import pytest

from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import Severity
from groundstation.bus.notice import Notice
from groundstation.diagnosis.loop import Diagnosis
from groundstation.diagnosis.process import DiagnosisSection, run
from groundstation.field.resolved import ResolvedField
from groundstation.process.child import Child

TURNS = 3


class FakeChild:
    """Lets a process run a few turns, and records its messages."""

    supervisor_alive = True
    turns = Child.turns

    def __init__(self, field: ResolvedField) -> None:
        self.bus = MemoryBus(MemoryExchange(), "lab", "diagnosis")
        self.section = msgspec.json.encode(DiagnosisSection(field))
        self.events: list[tuple[str, ...]] = []
        self.ticks: list[dict[str, Any]] = []
        self.begun = False
        self.beats = self.slept = 0

    @property
    def stop_requested(self) -> bool:
        return self.slept == TURNS

    def ready(self) -> None:
        self.begun = True

    def event(self, severity: str, text: str, remedy: str, entity: str | None) -> None:
        self.events.append((str(severity), text, remedy, entity or ""))

    def beat(self) -> None:
        self.beats += 1

    def tick_status(self, **values: Any) -> None:
        self.ticks.append(values)

    def sleep_until(self, _: int) -> None:
        self.slept += 1


def test_each_notice_is_told_once_and_each_turn_beats(
    lab_field: ResolvedField, monkeypatch: pytest.MonkeyPatch
) -> None:
    def turn(diagnosis: Diagnosis, _: int) -> None:
        if not child.slept:
            diagnosis.notices.append(Notice(Severity.WARNING, "the ceiling hangs aside", "survey it", "ceiling"))

    monkeypatch.setattr(Diagnosis, "turn", turn)
    child = FakeChild(lab_field)
    assert run(cast("Child", child)) == 0
    assert child.begun and child.events == [("WARNING", "the ceiling hangs aside", "survey it", "ceiling")]
    assert child.beats == TURNS and child.ticks[-1] == {"ticks": TURNS, "overflowed": 0}
