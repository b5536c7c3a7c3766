"""Two runs side by side: every figure of both with its difference; pure."""

from collections.abc import Iterator
from typing import Any

import msgspec

from groundstation.recording.part_names import shown
from groundstation.report.judge import RunReport

_FIGURES = (
    "tracked_s", "target_rmse_m", "target_lost_s", "min_separation_m", "max_fence_violation_m", "topology_switches",
    "planner_p50_ms", "planner_p99_ms", "tracker_missed_percent", "mean_cpu_cores", "command_to_airborne_s",
)  # fmt: skip


class FigureDifference(msgspec.Struct, frozen=True):
    """One figure of two runs; None where a run has none. change: second minus first."""

    figure: str
    first: float | None
    second: float | None

    @property
    def change(self) -> float | None:
        """Return second minus first, None unless both are known."""
        return None if self.first is None or self.second is None else self.second - self.first


def differences(first: RunReport, second: RunReport) -> list[FigureDifference]:
    """Return every figure that at least one of the runs has."""
    left, right = dict(_figures(first)), dict(_figures(second))
    names = list(dict.fromkeys([*left, *right]))
    return [FigureDifference(name, left.get(name), right.get(name)) for name in names]


def labels(first: RunReport, second: RunReport) -> tuple[str, str]:
    """Return the names of two runs in a comparison; one that is no flight is marked."""
    marks = [f" ({report.verdict})" if report.no_flight else "" for report in (first, second)]
    return f"first{marks[0]}", f"second{marks[1]}"


def as_json(first: RunReport, second: RunReport) -> bytes:
    """Return the comparison as JSON."""
    rows = [
        {"figure": row.figure, "first": row.first, "second": row.second, "change": row.change}
        for row in differences(first, second)
    ]
    runs = {"first": first, "second": second}
    content = {
        "schema_version": 1,
        **{name: shown(report.run_dir) for name, report in runs.items()},
        "reruns": {name: report.rerun for name, report in runs.items()},
        "figures": rows,
    }
    return msgspec.json.format(msgspec.json.encode(content), indent=2)


def _figures(report: RunReport) -> Iterator[tuple[str, float | None]]:
    figures: dict[str, Any] = msgspec.to_builtins(report.figures)
    for name in _FIGURES:
        yield name, figures[name]
    for kind, seconds in sorted(report.figures.topology_seconds.items()):
        yield f"topology_seconds.{kind}", seconds
    if report.figures.target is not None:
        yield "target.anees", report.figures.target.anees
    if len(report.figures.targets) > 1:
        for name, target in sorted(report.figures.targets.items()):
            yield f"{name}.rmse_m", target.rmse_m
            yield f"{name}.anees", target.anees
    for name, robot in sorted(report.figures.robots.items()):
        yield f"{name}.rmse_m", robot.rmse_m
        yield f"{name}.anees", robot.anees
    for edge in report.findings.edges:
        yield f"nis {edge.observer} → {edge.subject}", edge.nis_per_dof
    for item in report.findings.interventions:
        yield f"safety plans {item.robot} {item.cause}", float(item.plans)
