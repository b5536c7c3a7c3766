"""`groundstation report`: judges a recorded run again, or compares runs."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from groundstation.cli.exits import ExitCode
from groundstation.errors import GroundStationError, OperatorMistake, is_wrong_place

if TYPE_CHECKING:
    from groundstation.report.judge import RunReport

_RUNS = Path("runs")


@click.command(
    epilog="\b\nExamples:\n  groundstation report\n  groundstation report runs/20261120T101500Z-lab --json\n"
    "  groundstation report runs/20261120T101500Z-lab --compare runs/20261120T103000Z-lab\n"
    "  groundstation report runs --trend"
)
@click.argument("recording", required=False, type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print report.json (or the comparison) instead of the summary.")
@click.option("--no-plot", is_flag=True, help="Leave trajectories.png and report.html as they are.")
@click.option("--compare", "other", type=click.Path(path_type=Path), help="Another run: write comparison.html.")
@click.option("--trend", is_flag=True, help="RECORDING is a folder of runs: write its trend.html.")
def report(recording: Path | None, as_json: bool, no_plot: bool, other: Path | None, trend: bool) -> int:
    """Rebuild report.html, report.json and trajectories.png of a run folder (default: the newest in ./runs).

    Exit code 0 if the run passed, 1 if it did not. A comparison, and the report of a re-run (`replay --output`), of a
    cut or of a run in which no drone flew, judge nothing and end with 0.
    """
    from groundstation.report.build import build_report

    if trend:
        _trend(recording or _RUNS, as_json)
        return ExitCode.OK
    run_dir = _run_dir(recording) if recording else newest_run(_RUNS)
    if other is not None:
        _compare(run_dir, _run_dir(other), as_json)
        return ExitCode.OK
    built = _writing(lambda: build_report(run_dir, plot=not no_plot))
    _show(built, as_json)
    return ExitCode.FAILED if built.passed is False else ExitCode.OK


def _writing(build: Callable[[], "RunReport"]) -> "RunReport":
    try:
        return build()
    except OSError as error:
        told = f"{error.filename or 'the run folder'}: {error.strerror}; nothing of the recording is lost"
        if is_wrong_place(error):
            raise OperatorMistake(f"{told}: copy the run to a folder of yours") from error
        raise GroundStationError(told) from error


def _show(built: "RunReport", as_json: bool) -> None:
    if as_json:
        click.echo(built.as_json())
        return
    from groundstation.cli.terminal import show
    from groundstation.report.summary import summary

    show(summary(built))


def _compare(first: Path, second: Path, as_json: bool) -> None:
    from groundstation.report import compare
    from groundstation.report.gather import gather
    from groundstation.report.judge import judge
    from groundstation.report.page.comparison import NAME, write_comparison

    left, right = gather(first), gather(second)
    reports = judge(left, first), judge(right, second)
    if as_json:
        click.echo(compare.as_json(*reports))
        return
    try:
        write_comparison(((left, reports[0]), (right, reports[1])), first / NAME)
    except OSError as error:
        raise GroundStationError(f"{first / NAME}: {error.strerror}") from error
    from groundstation.cli.terminal import show
    from groundstation.report.summary import comparison

    show(comparison(*reports))
    click.echo(f"  {first / NAME}")


def _trend(folder: Path, as_json: bool) -> None:
    import msgspec

    from groundstation.report.page.trend import NAME, write_trend
    from groundstation.report.trend import judged_runs

    runs, damage = judged_runs(folder)
    if not runs:
        raise OperatorMistake(f"{folder}: no run in it has a report.json; `groundstation report RUN` writes one")
    if as_json:
        click.echo(msgspec.json.format(msgspec.json.encode(runs), indent=2))
        return
    try:
        write_trend(runs, damage, folder / NAME)
    except OSError as error:
        kind = OperatorMistake if is_wrong_place(error) else GroundStationError
        raise kind(f"{folder / NAME}: {error.strerror}") from error
    for line in damage:
        click.echo(f"cannot be read: {line}", err=True)
    passed = sum(run.verdict == "passed" for run in runs)
    click.echo(f"{folder / NAME}: {len(runs)} run{'s' * (len(runs) != 1)}, {passed} passed")


def _run_dir(path: Path) -> Path:
    """Return the run folder for a folder or a recording in it."""
    if not path.exists():
        raise OperatorMistake(f"{path}: there is no such run")
    if path.is_dir():
        return path
    if not any(path.parent.glob("state*.mcap")):
        from groundstation.recording.foreign import kind_of_file

        what = kind_of_file(path)
        hint = f": this is {what}" if what else ", and no state.mcap beside it: name a run's folder"
        raise OperatorMistake(f"{path}: no recording of a run{hint}")
    return path.parent


def newest_run(folder: Path) -> Path:
    """Return the folder with the newest recording of a run; raises OperatorMistake for none.

    A cut of another one is none, and neither is a check before a take-off.
    """
    from groundstation.recording.file_topics import STATE
    from groundstation.recording.part_names import numbered_parts
    from groundstation.recording.stretch import is_stretch
    from groundstation.report import run_facts

    # Not `state-recovered.mcap` and other copies, which may be of any age.
    parts = (path for run in folder.glob("*/") for _, path in numbered_parts(run, STATE))
    recordings = sorted(parts, key=lambda path: path.stat().st_mtime, reverse=True)
    runs = (path for path in recordings if not run_facts.read(path.parent).is_check)
    newest = next((path for path in runs if not is_stretch(path)), None)
    if newest is None:
        raise OperatorMistake(f"no recorded run in {folder.absolute()}: name a run folder")
    return newest.parent
