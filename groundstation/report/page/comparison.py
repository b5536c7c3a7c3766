"""comparison.html: two runs on one time axis that begins with each one's tracking."""

from html import escape
from pathlib import Path

import numpy as np

from groundstation.appearance.cost import COST_UNIT, cost_cm2
from groundstation.arrays import Array
from groundstation.report.accuracy import errors_at
from groundstation.report.compare import differences, labels
from groundstation.report.interval import tracking_interval
from groundstation.report.judge import RunReport
from groundstation.report.page.chart import Chart, Curve, chart_times, held, points, times
from groundstation.report.page.document import holders, no_flight_note, page
from groundstation.report.page.flight_charts import semi_axis_m
from groundstation.report.page.tables import number, table
from groundstation.report.plot_style import SERIES_COLORS
from groundstation.report.tracks import RunData
from groundstation.report.wording import title

NAME = "comparison.html"
_PLAN_HOLDS_S = 0.5


def write_comparison(runs: tuple[tuple[RunData, RunReport], tuple[RunData, RunReport]], path: Path) -> None:
    """Write the page that sets two runs side by side."""
    first, second = runs[0][1], runs[1][1]
    called = labels(first, second)
    charts = [chart for chart in (_errors(runs, called), _beliefs(runs, called), _costs(runs, called)) if chart.curves]
    names = [escape(report.name) for report in (first, second)]
    rows = [
        (title(row.figure), number(row.first), number(row.second), number(row.change))
        for row in differences(first, second)
    ]
    sections = [
        ("Figures", table(("figure", *called, "change"), rows, "Neither run has figures.")),
        ("Over time", holders(charts, 0)),
    ]
    lead = f"<p>first: <b>{names[0]}</b> ({first.verdict}), second: <b>{names[1]}</b> ({second.verdict})</p>"
    lead += "".join(no_flight_note(report) for report in (first, second))
    path.write_text(page(f"{first.name} and {second.name}", lead, sections, charts), encoding="utf-8")


def _grids(runs: tuple[tuple[RunData, RunReport], ...]) -> tuple[Array, list[float]]:
    """Return the common time axis [s since tracking began] and its begin in each recording."""
    spans = [tracking_interval(data) or (0.0, max(data.end_s, 1.0)) for data, _ in runs]
    return chart_times(0.0, max(end - start for start, end in spans)), [start for start, _ in spans]


def _errors(runs: tuple[tuple[RunData, RunReport], ...], called: tuple[str, str]) -> Chart:
    grid, starts = _grids(runs)
    curves = []
    for color, label, start, (data, _) in zip(SERIES_COLORS, called, starts, runs, strict=False):
        for rank, name in enumerate(data.tracked):
            truth = data.truth.get(name)
            if truth is not None:
                errors = errors_at(grid + start, truth, data.estimates.get(name), 2)
                distances = points(np.linalg.norm(errors, axis=1))
                curves.append(Curve(_label(label, name, data), color, distances, dashed=rank > 0))
    return Chart("Target error", "m", "distance between estimate and truth", times(grid), curves)


def _label(run: str, target: str, data: RunData) -> str:
    return run if len(data.tracked) == 1 else f"{run}, {target}"


def _beliefs(runs: tuple[tuple[RunData, RunReport], ...], called: tuple[str, str]) -> Chart:
    grid, starts = _grids(runs)
    curves = [
        Curve(
            _label(label, name, data),
            color,
            points(semi_axis_m(data.estimates[name], grid + start)),
            dashed=rank > 0,
        )
        for color, label, start, (data, _) in zip(SERIES_COLORS, called, starts, runs, strict=False)
        for rank, name in enumerate(data.tracked)
        if name in data.estimates
    ]
    note = "larger semi-axis of the target's 95 % ellipse"
    return Chart("Estimated uncertainty of the target", "m", note, times(grid), curves)


def _costs(runs: tuple[tuple[RunData, RunReport], ...], called: tuple[str, str]) -> Chart:
    grid, starts = _grids(runs)
    curves = []
    for color, label, start, (data, _) in zip(SERIES_COLORS, called, starts, runs, strict=False):
        own, cost = [plan.time_s for plan in data.plans], [cost_cm2(plan.message.cost) for plan in data.plans]
        curves.append(Curve(label, color, points(held(grid + start, own, cost, _PLAN_HOLDS_S), 2)))
    return Chart("Plan cost", COST_UNIT, "of the chosen topology", times(grid), curves)
