"""From a run folder to report.json and trajectories.png."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from groundstation.report.criteria import Criterion, criteria_of, is_valid
from groundstation.report.gather import gather
from groundstation.report.metrics import Figures, figures_of
from groundstation.report.run_facts import RunFacts
from groundstation.report.tracks import RunData

SCHEMA_VERSION = 1
JSON_NAME = "report.json"
PLOT_NAME = "trajectories.png"
_DAMAGE_LINES = 20


@dataclass(frozen=True, slots=True)
class Report:
    """A judged run. `valid`: the simulator kept real time; `passed`: valid and all criteria met."""

    run_dir: Path
    facts: RunFacts
    figures: Figures
    criteria: tuple[Criterion, ...]
    valid: bool
    damage: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether the run was what it should be."""
        return self.valid and all(criterion.ok for criterion in self.criteria)

    def as_json(self) -> bytes:
        """Return report.json: the figures at the top level, beside verdict and criteria."""
        content: dict[str, Any] = {
            "schema_version": SCHEMA_VERSION,
            "passed": self.passed,
            "valid": self.valid,
            "criteria": self.criteria,
            "run": self.facts,
            **msgspec.to_builtins(self.figures),
            "damage": self.damage,
        }
        return msgspec.json.format(msgspec.json.encode(content), indent=2)


def build_report(run_dir: Path, *, plot: bool = True) -> Report:
    """Judge a run and write its files; raises RecordingError when there is no recording."""
    data = gather(run_dir)
    report = judge(data, run_dir)
    (run_dir / JSON_NAME).write_bytes(report.as_json())
    if plot:
        from groundstation.report.plot import draw  # matplotlib takes half a second to import

        draw(data, _title(report), run_dir / PLOT_NAME)
    return report


def judge(data: RunData, run_dir: Path) -> Report:
    """Return the report of a run's data; writes nothing."""
    figures = figures_of(data)
    criteria = tuple(criteria_of(figures, data.arena, data.facts))
    return Report(run_dir, data.facts, figures, criteria, is_valid(figures), tuple(data.damage[:_DAMAGE_LINES]))


def _title(report: Report) -> str:
    figures = report.figures
    error = "no tracking" if figures.target_rmse_m is None else f"target error {figures.target_rmse_m:.3f} m rms"
    verdict = "passed" if report.passed else "FAILED" if report.valid else "INVALID"
    return f"{report.run_dir.name}: {error} over {figures.tracked_s:.0f} s, {verdict}"
