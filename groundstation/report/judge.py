"""The judgement of a run: its figures against the criteria, and what else was found."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from groundstation.recording.part_names import shown
from groundstation.recording.rerun import Rerun
from groundstation.report.criteria import Criterion, criteria_of, is_valid
from groundstation.report.findings import Findings, findings_of
from groundstation.report.metrics import RunFigures, figures_of
from groundstation.report.run_facts import RunFacts
from groundstation.report.tracks import RunData
from groundstation.report.wording import missed

SCHEMA_VERSION = 1
_DAMAGE_LINES = 20


@dataclass(frozen=True, slots=True)
class RunReport:
    """A judged run. `valid`: the simulator kept real time; `rerun`: what it repeats, where it is no flight."""

    run_dir: Path
    facts: RunFacts
    figures: RunFigures
    criteria: tuple[Criterion, ...]
    findings: Findings
    valid: bool
    damage: tuple[str, ...]
    rerun: Rerun | None = None

    @property
    def name(self) -> str:
        """Return what the run is called: the name of its folder."""
        return shown(self.run_dir.resolve().name)

    @property
    def passed(self) -> bool | None:
        """Whether the run was what it should be: valid, and all criteria met; None for a re-run, which is no flight."""
        if self.rerun is not None:
            return None
        return self.valid and all(criterion.ok for criterion in self.criteria)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Return why it did not pass, in words; nothing where it did, or where there is nothing to judge."""
        if self.passed is not False:
            return ()
        if not self.valid:
            return ("the simulator did not keep real time",)
        return tuple(missed(criterion) for criterion in self.criteria if not criterion.ok)

    @property
    def verdict(self) -> str:
        """Return passed, failed or invalid; re-run or what-if where there is nothing to judge."""
        if self.rerun is not None:
            return self.rerun.kind
        return "passed" if self.passed else "failed" if self.valid else "invalid"

    def as_json(self) -> bytes:
        """Return report.json: the figures at the top level, beside verdict, criteria and findings."""
        content: dict[str, Any] = {
            "schema_version": SCHEMA_VERSION,
            "passed": self.passed,
            "verdict": self.verdict,
            "reasons": self.reasons,
            "valid": self.valid,
            "rerun": self.rerun,
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
    criteria = () if data.rerun else tuple(criteria_of(figures, data.resolved, data.facts))
    damage = tuple(data.damage[:_DAMAGE_LINES])
    return RunReport(run_dir, data.facts, figures, criteria, findings_of(data), is_valid(figures), damage, data.rerun)
