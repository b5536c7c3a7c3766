"""trend.html: the figures of many runs, one after the other, and the reasons of failures."""

from collections.abc import Sequence
from html import escape
from pathlib import Path

from groundstation.recording.part_names import shown
from groundstation.report.page.chart import Chart, Curve
from groundstation.report.page.document import holders, page
from groundstation.report.page.tables import table
from groundstation.report.plot_style import SERIES_COLORS
from groundstation.report.trend import FIGURES, JudgedRun
from groundstation.report.wording import quantity, title, unit

NAME = "trend.html"


def write_trend(runs: Sequence[JudgedRun], damage: Sequence[str], path: Path) -> None:
    """Write the page of many runs; `damage` names reports that could not be read."""
    charts = [_chart(figure, runs) for figure in FIGURES if any(run.figures[figure] is not None for run in runs)]
    passed = sum(run.verdict == "passed" for run in runs)
    lead = f"<p>{len(runs)} run{'s' * (len(runs) != 1)}, {passed} passed.</p>" + "".join(
        f"<p>{escape(line)}</p>" for line in damage
    )
    sections = [("Run by run", holders(charts, 0)), ("Runs", _table(runs))]
    path.write_text(page(f"Runs of {shown(path.parent.absolute().name)}", lead, sections, charts), encoding="utf-8")


def _chart(figure: str, runs: Sequence[JudgedRun]) -> Chart:
    numbers = [float(number) for number in range(1, len(runs) + 1)]
    curve = Curve(title(figure), SERIES_COLORS[0], [run.figures[figure] for run in runs])
    return Chart(title(figure).capitalize(), unit(figure), "by number of the run", numbers, [curve], axis="")


def _table(runs: Sequence[JudgedRun]) -> str:
    rows = [
        (
            number,
            run.name,
            run.verdict,
            run.facts.mode,
            quantity("target_rmse_m", run.figures["target_rmse_m"]),
            "; ".join(run.reasons),
        )
        for number, run in enumerate(runs, 1)
    ]
    return table(("number", "run", "verdict", "mode", title("target_rmse_m"), "why"), rows, "No run was judged here.")
