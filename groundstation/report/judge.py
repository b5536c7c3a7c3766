"""The judgement of a run: its figures against the criteria, and what else was found."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from groundstation.report.criteria import Criterion, criteria_of, is_valid
from groundstation.report.findings import Findings, findings_of
from groundstation.report.metrics import Figures, figures_of
from groundstation.report.run_facts import RunFacts
from groundstation.report.tracks import RunData

SCHEMA_VERSION = 1
_DAMAGE_LINES = 20


@dataclass(frozen=True, slots=True)
class Report:
    """A judged run. `valid`: the simulator kept real time; `passed`: valid and all criteria met."""

    run_dir: Path
    facts: RunFacts
    figures: Figures
    criteria: tuple[Criterion, ...]
    findings: Findings
    valid: bool
    damage: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether the run was what it should be."""
        return self.valid and all(criterion.ok for criterion in self.criteria)

    def as_json(self) -> bytes:
        """Return report.json: the figures at the top level, beside verdict, criteria and findings."""
        content: dict[str, Any] = {
            "schema_version": SCHEMA_VERSION,
            "passed": self.passed,
            "valid": self.valid,
            "criteria": self.criteria,
            "run": self.facts,
            **msgspec.to_builtins(self.figures),
            "findings": self.findings,
            "damage": self.damage,
        }
        return msgspec.json.format(msgspec.json.encode(content), indent=2)


def judge(data: RunData, run_dir: Path) -> Report:
    """Return the report of a run's data; writes nothing."""
    figures = figures_of(data)
    criteria = tuple(criteria_of(figures, data.arena, data.facts))
    damage = tuple(data.damage[:_DAMAGE_LINES])
    return Report(run_dir, data.facts, figures, criteria, findings_of(data), is_valid(figures), damage)
