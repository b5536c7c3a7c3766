"""The runs of a folder beside each other, by time, from their report.json."""

from pathlib import Path
from typing import Any

import msgspec

from groundstation.recording.part_names import shown
from groundstation.report.criteria import Criterion
from groundstation.report.file_names import JSON_NAME
from groundstation.report.run_facts import RunFacts
from groundstation.report.wording import missed as in_words

# Figures to compare from flight to flight, in the order of the page.
FIGURES = (
    "target_rmse_m",
    "target_lost_s",
    "min_separation_m",
    "max_fence_violation_m",
    "topology_switches",
    "planner_p99_ms",
    "tracker_missed_percent",
    "mean_cpu_cores",
)


class JudgedRun(msgspec.Struct, frozen=True):
    """A run with its verdict, its figures by name, its missed criteria, and the reasons of its failure in words."""

    name: str
    facts: RunFacts
    verdict: str
    figures: dict[str, float | None]
    missed: tuple[Criterion, ...] = ()
    reasons: tuple[str, ...] = ()


class _Report(msgspec.Struct):
    passed: bool | None
    valid: bool
    rerun: Any = None
    cut: Any = None
    criteria: tuple[Criterion, ...] = ()
    reasons: tuple[str, ...] = ()
    run: RunFacts = RunFacts()


def judged_runs(folder: Path) -> tuple[list[JudgedRun], list[str]]:
    """Return the runs of a folder in order of their names, which begin with their times, and unreadable reports.

    Re-runs, cuts and runs in which nobody flew are left out: they are no flights.
    """
    runs, damage = [], []
    for path in sorted(folder.glob(f"*/{JSON_NAME}")):
        try:
            data = path.read_bytes()
            report, figures = msgspec.json.decode(data, type=_Report), msgspec.json.decode(data)
        except (OSError, msgspec.DecodeError) as error:
            damage.append(f"{shown(path)}: {error}")
            continue
        without = report.passed is None or report.run.is_check
        if report.rerun is None and report.cut is None and not without:
            runs.append(_run(shown(path.parent.name), report, figures))
    return runs, damage


def _run(name: str, report: _Report, figures: dict[str, Any]) -> JudgedRun:
    verdict = "passed" if report.passed else "failed" if report.valid else "invalid"
    known = {figure: float(value) for figure in FIGURES if isinstance(value := figures.get(figure), int | float)}
    missed = tuple(one for one in report.criteria if not one.ok)
    figures = {figure: known.get(figure) for figure in FIGURES}
    # Reports of earlier versions have the criteria only.
    return JudgedRun(name, report.run, verdict, figures, missed, report.reasons or tuple(map(in_words, missed)))
