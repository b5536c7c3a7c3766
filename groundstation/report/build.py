"""Builds report.json, report.html and trajectories.png from a run folder."""

from pathlib import Path

from groundstation.report.file_names import HTML_NAME, JSON_NAME, PLOT_NAME
from groundstation.report.gather import gather
from groundstation.report.judge import RunReport, judge


def build_report(run_dir: Path, *, plot: bool = True) -> RunReport:
    """Judge a run and write its files; raises RecordingError when there is no recording."""
    data = gather(run_dir)
    report = judge(data, run_dir)
    (run_dir / JSON_NAME).write_bytes(report.as_json())
    if plot:
        from groundstation.report.page.document import write_page  # matplotlib takes half a second to import
        from groundstation.report.plot import draw

        draw(data, title(report), run_dir / PLOT_NAME)
        write_page(data, report, run_dir / HTML_NAME)
    return report


def title(report: RunReport) -> str:
    """Return the title of the picture of the paths."""
    figures = report.figures
    error = "no tracking" if figures.target_rmse_m is None else f"target error {figures.target_rmse_m:.3f} m rms"
    verdict = "passed" if report.passed else report.verdict.upper()
    of = f" of {report.rerun.of}" if report.rerun else ""
    return f"{report.name}: {error} over {figures.tracked_s:.0f} s, {verdict}{of}"
