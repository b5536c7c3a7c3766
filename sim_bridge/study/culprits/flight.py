"""One flight with wrong figures: the team is judged on its pads, then takes off whatever the findings."""

from collections.abc import Sequence
from typing import Any

from groundstation.bus.messages import RangeObservation, RelativeObservation
from groundstation.bus.notice import Notice
from groundstation.bus.topics import OBSERVATION, RANGE
from groundstation.diagnosis.judging import AtOnce
from groundstation.diagnosis.loop import Diagnosis
from groundstation.doctor.finding import Level
from groundstation.preflight.judge import pad_findings
from groundstation.preflight.pad_record import PadRecord
from sim_bridge.study.faults.draw import Drawn
from sim_bridge.study.faults.vehicles import Section
from sim_bridge.study.scenarios.flight import ScenarioFlight
from sim_bridge.study.wrong_figures import WrongFigures


class CulpritFlight(ScenarioFlight):
    """A flight that keeps findings and notices; `fly` returns them with the figures of tracking.

    on_pads: findings other than OK as [level, text]; told: [s after the order to take off, severity, entity, text,
    remedy] of each notice.
    """

    def __init__(
        self,
        drawn: Drawn,
        sections: Sequence[Section],
        seconds: float,
        wrong: WrongFigures,
        stand_s: float,
        diagnosed_from_s: float,
    ) -> None:
        super().__init__(drawn, sections, seconds, "ours", wrong)
        self._stand_s, self._diagnosed_from_s = stand_s, diagnosed_from_s
        self.on_pads: list[tuple[str, str]] | None = None
        self.told: list[tuple[float, str, str, str, str]] = []
        self._pads = PadRecord(self._field.world_sensors)
        self._sightings = self._bus("preflight").subscribe([OBSERVATION, RANGE])
        self._diagnosis: Diagnosis | None = None

    def may_start(self) -> bool:
        """Return whether the team may take off: once it has stood for a while and its pads are judged."""
        if self.on_pads is not None:
            return True
        for received in self._sightings.drain():
            if isinstance(received.message, RelativeObservation | RangeObservation):
                self._pads.see(received.message, self.now_ns)
        if self.world.time_s >= self._stand_s:
            findings = pad_findings(self._field, self._pads.medians(self.now_ns))
            self.on_pads = [
                (str(one.level), f"{one.subject}: {one.found}") for one in findings if one.level is not Level.OK
            ]
        return False

    def step(self) -> None:
        """Advance by a tick, with the diagnosis."""
        super().step()
        if self._diagnosis is None:
            if self.world.time_s >= self._diagnosed_from_s:
                self._diagnosis = Diagnosis(self._bus("diagnosis"), self._field, AtOnce())
            return
        self._diagnosis.turn(self.now_ns)
        for notice in self._diagnosis.notices:
            self.note(self.world.time_s, notice)
        self._diagnosis.notices.clear()

    def note(self, now_s: float, notice: Notice) -> None:
        """Keep a notice with its time."""
        super().note(now_s, notice)
        if self.on_pads is not None:
            row = (str(notice.severity), notice.entity, notice.text, notice.remedy)
            self.told.append((round(now_s - self._stand_s, 2), *row))

    def fly(self) -> dict[str, Any]:
        """Fly to the end; returns seed, findings, notices, figures and the time spent."""
        return {**super().fly(), "on_pads": self.on_pads, "told": self.told}
