"""One flight with wrong figures: the team stands on its pads and is judged, then takes off all the same."""

from collections.abc import Sequence
from typing import Any

from groundstation.bus import clock
from groundstation.bus.messages import RelativeObservation, Suspicion
from groundstation.bus.notice import Notice
from groundstation.bus.topics import OBSERVATION, SUSPICION
from groundstation.calibration.flown import Flown
from groundstation.diagnosis.loop import PAUSE_NS
from groundstation.diagnosis.suspects import verdict_on
from groundstation.diagnosis.watch import FigureWatch
from groundstation.diagnosis.window import TOPICS, Window
from groundstation.doctor.finding import Level
from groundstation.preflight.judge import pad_findings
from groundstation.preflight.pad_record import PadRecord
from sim_bridge.study.faults.draw import Drawn
from sim_bridge.study.faults.vehicles import Section
from sim_bridge.study.scenarios.flight import ScenarioFlight
from sim_bridge.study.wrong_figures import WrongFigures

_CAPACITY = 8192


class CulpritFlight(ScenarioFlight):
    """A flight that notes what is told; `fly` returns it with the figures of tracking.

    on_pads: findings that are not well as [level, text]; told: [s after the order to take off, severity, entity, text,
    remedy] of each notice.
    """

    def __init__(
        self, drawn: Drawn, sections: Sequence[Section], seconds: float, wrong: WrongFigures, stand_s: float
    ) -> None:
        super().__init__(drawn, sections, seconds, "ours", wrong)
        self._stand_s = stand_s
        self.on_pads: list[tuple[str, str]] | None = None
        self.told: list[tuple[float, str, str, str, str]] = []
        self._pads = PadRecord(self._field.world_sensors)
        self._sightings = self._bus("preflight").subscribe([OBSERVATION])
        self._diagnosis_bus = self._bus("diagnosis")
        self._arrived = self._diagnosis_bus.subscribe(TOPICS, capacity=_CAPACITY)
        self._window, self._figures = Window(clock.clock_id()), FigureWatch(self._field)
        self._verdict_due_ns = 0

    def may_start(self) -> bool:
        """Judge the pads once the team has stood for a while; then it may."""
        if self.on_pads is not None:
            return True
        for received in self._sightings.drain():
            if isinstance(received.message, RelativeObservation):
                self._pads.see(received.message, self.now_ns)
        if self.world.time_s >= self._stand_s:
            findings = pad_findings(self._field, self._pads.medians(self.now_ns))
            self.on_pads = [
                (str(one.level), f"{one.subject}: {one.found}") for one in findings if one.level is not Level.OK
            ]
        return False

    def step(self) -> None:
        """Advance by a tick; the diagnosis takes in what arrived and gives verdicts, as its process does."""
        super().step()
        now_ns = self.now_ns
        for received in self._arrived.drain():
            if received.message is not None:
                self._window.take(str(received.key), received.message, now_ns)
        if now_ns >= self._verdict_due_ns and (flown := self._window.flown()) is not None:
            self._verdict_due_ns = now_ns + PAUSE_NS
            self._diagnose(flown)

    def _diagnose(self, flown: Flown) -> None:
        verdict = verdict_on(flown, self._field)
        if verdict is None:
            return
        for notice in self._figures.take(verdict):
            self.note(self.world.time_s, notice)
        header = self._diagnosis_bus.header("diagnosis", self.now_ns)
        self._diagnosis_bus.publish(SUSPICION, Suspicion(header=header, cause=self._figures.cause))

    def note(self, now_s: float, notice: Notice) -> None:
        """Keep what is told, with its time."""
        super().note(now_s, notice)
        if self.on_pads is not None:
            row = (str(notice.severity), notice.entity, notice.text, notice.remedy)
            self.told.append((round(now_s - self._stand_s, 2), *row))

    def fly(self) -> dict[str, Any]:
        """Fly to the end; returns seed, findings, notices, figures and the time spent."""
        return {**super().fly(), "on_pads": self.on_pads, "told": self.told}
