"""The judgement of a run: its figures against the criteria, and its findings."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from groundstation.bus.messages import RUN_ENDED, Severity
from groundstation.recording.part_names import shown
from groundstation.recording.rerun import Rerun
from groundstation.recording.stretch import Stretch
from groundstation.report import run_facts
from groundstation.report.criteria import Criterion, criteria_of, invalidity, overload
from groundstation.report.expectation import expectation_of
from groundstation.report.findings import Findings, findings_of
from groundstation.report.metrics import RunFigures, figures_of
from groundstation.report.not_flown import NotFlown, not_flown
from groundstation.report.run_facts import RunFacts
from groundstation.report.tracks import RunData
from groundstation.report.wording import missed

SCHEMA_VERSION = 1
_DAMAGE_LINES = 20


@dataclass(frozen=True, slots=True)
class RunReport:
    """A judged run.

    invalid: why its figures mean nothing, "" if they count; rerun, stretch: what it repeats or is a part of;
    not_flown: how it is a run without a flight; broken_off: the failure that ended it, "" without; recorded_s: where
    the recording breaks off in flight, None where it does not.
    """

    run_dir: Path
    facts: RunFacts
    figures: RunFigures
    criteria: tuple[Criterion, ...]
    findings: Findings
    invalid: str
    damage: tuple[str, ...]
    rerun: Rerun | None = None
    stretch: Stretch | None = None
    not_flown: NotFlown | None = None
    broken_off: str = ""
    recorded_s: float | None = None

    @property
    def no_flight(self) -> Rerun | Stretch | NotFlown | None:
        """Return why this is no whole flight (a re-run, a part of a recording, nobody flew); None if it is one."""
        return self.rerun or self.stretch or self.not_flown

    @property
    def name(self) -> str:
        """Return the name of the run: that of its folder."""
        return shown(self.run_dir.resolve().name)

    @property
    def valid(self) -> bool:
        """Return whether its figures count: the computer was not too busy to simulate it."""
        return not self.invalid

    @property
    def passed(self) -> bool | None:
        """Whether it is valid, ended by no failure, recorded until the landing, and meets all criteria.

        None for no flight.
        """
        if self.no_flight is not None:
            return None
        ended_well = not self.broken_off and self.recorded_s is None
        return self.valid and ended_well and all(criterion.ok for criterion in self.criteria)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Return the reasons for its failure, in words; empty if it passed or there is nothing to judge."""
        if self.passed is not False:
            return ()
        if self.invalid:
            return tuple(filter(None, (self.broken_off, self.invalid)))
        if self.broken_off and not self.figures.flew:
            return (self.broken_off,)  # without a flight every other criterion is missed for that reason
        off = self.recorded_s
        broken = "" if off is None else f"the recording breaks off after {off:.0f} s, before the run ended"
        missing = (missed(criterion) for criterion in self.criteria if not criterion.ok)
        return tuple(filter(None, (self.broken_off, broken, *missing, overload(self.figures))))

    @property
    def verdict(self) -> str:
        """Return passed, failed or invalid; re-run, what-if, cut, check or not flown where nothing is judged."""
        if self.no_flight is not None:
            return self.no_flight.kind
        return "passed" if self.passed else "failed" if self.valid else "invalid"

    def as_json(self) -> bytes:
        """Return the content of report.json: figures at the top level, beside verdict, criteria and findings."""
        content: dict[str, Any] = {
            "schema_version": SCHEMA_VERSION,
            "passed": self.passed,
            "verdict": self.verdict,
            "reasons": self.reasons,
            "valid": self.valid,
            "rerun": self.rerun,
            "cut": self.stretch,
            "criteria": self.criteria,
            "run": self.facts,
            **msgspec.to_builtins(self.figures),
            "findings": self.findings,
            "damage": self.damage,
        }
        return msgspec.json.format(msgspec.json.encode(content), indent=2)


def judge(data: RunData, run_dir: Path) -> RunReport:
    """Return the report of a run's data; writes nothing."""
    figures = figures_of(data)
    broken_off, recorded_s = _broken_off(data), data.end_s if data.breaks_off and figures.landed is None else None
    without = not_flown(data.facts, flew=figures.flew, failed=bool(broken_off) or recorded_s is not None)
    is_flight = data.rerun is None and data.stretch is None and without is None
    criteria = tuple(criteria_of(figures, data.resolved, data.facts)) if is_flight else ()
    unread = expectation_of(data.facts)[1] if is_flight else ""
    return RunReport(
        run_dir=run_dir,
        facts=data.facts,
        figures=figures,
        criteria=criteria,
        findings=findings_of(data),
        invalid=invalidity(figures, criteria),
        damage=(*([f"{run_facts.NAME}: {unread}"] if unread else []), *data.damage[:_DAMAGE_LINES]),
        rerun=data.rerun,
        stretch=data.stretch,
        not_flown=without,
        broken_off=broken_off,
        recorded_s=recorded_s,
    )


def _broken_off(data: RunData) -> str:
    """Return the failure that ended the run, as it reported it."""
    ends = [timed.message for timed in data.events if timed.message.ends_run]
    return next((one.text.removeprefix(RUN_ENDED) for one in ends if one.severity is Severity.ERROR), "")
