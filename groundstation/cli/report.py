"""`groundstation report`: judge a recorded run once more."""

from pathlib import Path

import click

from groundstation.cli.exits import ExitCode
from groundstation.errors import GroundStationError

_RUNS = Path("runs")


@click.command(epilog="\b\nExamples:\n  groundstation report\n  groundstation report runs/20261120T101500Z-lab --json")
@click.argument("run_dir", required=False, type=click.Path(file_okay=False, path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print report.json instead of the summary.")
@click.option("--no-plot", is_flag=True, help="Leave trajectories.png as it is.")
def report(run_dir: Path | None, as_json: bool, no_plot: bool) -> int:
    """Rebuild report.json and trajectories.png of a run folder (default: the newest in ./runs).

    Exit code 0 when the run passed, 1 when it did not.
    """
    from groundstation.report.build import build_report

    built = build_report(run_dir or newest_run(_RUNS), plot=not no_plot)
    if as_json:
        click.echo(built.as_json())
    else:
        from rich.console import Console

        from groundstation.report.summary import summary

        Console().print(summary(built))
    return ExitCode.OK if built.passed else ExitCode.FAILED


def newest_run(folder: Path) -> Path:
    """Return the run folder with the newest recording; raises GroundStationError when there is none."""
    recordings = sorted(folder.glob("*/state.mcap"), key=lambda path: path.stat().st_mtime)
    if not recordings:
        raise GroundStationError(f"no recorded run in {folder.absolute()}: name a run folder")
    return recordings[-1].parent
