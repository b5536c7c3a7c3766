"""`groundstation recording export`, also `groundstation export`: recordings in the formats of other programs."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from groundstation.cli.exits import ExitCode

if TYPE_CHECKING:
    from groundstation.recording.run import RecordedRun

_MAX_LINES = 5


@click.command(
    short_help="Write a recorded run in the formats of other programs.",
    epilog="\b\nExamples:\n  groundstation recording export --csv runs/20261120T120000Z-lab\n"
    "  groundstation recording export --rrd --output flight.rrd runs/20261120T120000Z-lab\n"
    "  groundstation export --tlog runs/20261120T120000Z-mixed-team",
)
@click.argument("recording", type=click.Path(exists=True, path_type=Path))
@click.option("--csv", "formats", flag_value="csv", multiple=True, help="One table for each topic, units in the names.")
@click.option("--parquet", "formats", flag_value="parquet", multiple=True, help="The same, typed; extra [parquet].")
@click.option("--rrd", "formats", flag_value="rrd", multiple=True, help="A scene for the Rerun viewer; extra [rerun].")
@click.option(
    "--foxglove-scene",
    "formats",
    flag_value="scene",
    multiple=True,
    help="A copy with ellipses, links and arrows for Foxglove's 3D panel; extra [foxglove].",
)
@click.option("--tlog", "formats", flag_value="tlog", multiple=True, help="Logs of autopilots, one for each vehicle.")
@click.option("--rosbag2", "formats", flag_value="rosbag2", multiple=True, help="A bag for ROS 2 tools; extra [ros2].")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="File or folder to write (default: beside the recording)."
)
def export(recording: Path, formats: tuple[str, ...], output: Path | None) -> int:
    """Write RECORDING, a run folder or one file of it, in other formats.

    Recordings that were cut off are read as far as they go.
    """
    from groundstation.recording.run import open_run

    if not formats:
        raise click.UsageError("say which format: --csv, --parquet, --rrd, --foxglove-scene, --tlog or --rosbag2")
    if output is not None and len(formats) > 1:
        raise click.UsageError("--output names one place: export one format at a time, or leave it out")
    run = open_run(recording)
    for name in formats:
        _WRITERS[name](run, recording, output)
    _tell("damaged, read as far as it is sound", run.damage)
    return ExitCode.OK


def _tables(kind: str) -> "Callable[[RecordedRun, Path, Path | None], None]":
    def write(run: "RecordedRun", recording: Path, output: Path | None) -> None:
        from groundstation.engineering_views.extras import require_parquet
        from groundstation.recording.table_files import CsvFile, ParquetFile, write_tables

        if kind == "parquet":
            require_parquet()
        folder = output or _beside(recording, kind, is_folder=True)
        counts, unread = write_tables(run, folder, CsvFile if kind == "csv" else ParquetFile)
        for name, count in sorted(counts.items()):
            click.echo(f"{folder / name}.{kind}: {count} rows")
        _tell("not readable", unread)

    return write


def _rrd(run: "RecordedRun", recording: Path, output: Path | None) -> None:
    from groundstation.engineering_views.rerun_file import write_rrd

    path = output or _beside(recording, "rrd")
    count, unread = write_rrd(run, path)
    click.echo(f"{path}: {count} messages; open it with: rerun {path}")
    _tell("not readable", unread)


def _scene(run: "RecordedRun", recording: Path, output: Path | None) -> None:
    from groundstation.engineering_views.foxglove_file import write_with_scene

    path = output or _beside(recording, "scene.mcap")
    count, unread = write_with_scene(run, path)
    click.echo(f"{path}: {count} scenes beside everything else; open it in Foxglove or Lichtblick")
    _tell("not readable", unread)


def _tlog(run: "RecordedRun", recording: Path, output: Path | None) -> None:
    from groundstation.cli.tlog import write_tlogs

    folder = output or (recording if recording.is_dir() else recording.parent)
    for path, log in write_tlogs(run, folder).items():
        if log.frames:
            click.echo(f"{path}: {len(log.frames)} frames")
        _tell(f"{path.stem}: left out", (f"{n} x {reason.replace('_', ' ')}" for reason, n in log.refused.items()))


def _rosbag2(run: "RecordedRun", recording: Path, output: Path | None) -> None:
    from groundstation.engineering_views.extras import require_ros2

    require_ros2()
    from groundstation.engineering_views.ros2.bag import write_bag

    folder = output or _beside(recording, "rosbag2", is_folder=True)
    count, unread = write_bag(run, folder)
    click.echo(f"{folder}: {count} messages; ros2 bag info {folder}")
    _tell("not readable", unread)


_WRITERS: "dict[str, Callable[[RecordedRun, Path, Path | None], None]]" = {
    "csv": _tables("csv"),
    "parquet": _tables("parquet"),
    "rrd": _rrd,
    "scene": _scene,
    "tlog": _tlog,
    "rosbag2": _rosbag2,
}


def _beside(recording: Path, suffix: str, *, is_folder: bool = False) -> Path:
    """Return the default output path: inside a run folder, beside a file."""
    if recording.is_dir():
        return recording / (suffix if is_folder else f"{recording.resolve().name}.{suffix}")
    return recording.with_name(f"{recording.stem}-{suffix}" if is_folder else f"{recording.stem}.{suffix}")


def _tell(title: str, lines: Iterable[str]) -> None:
    listed = list(lines)
    for line in listed[:_MAX_LINES]:
        click.echo(f"{title}: {line}", err=True)
    if len(listed) > _MAX_LINES:
        click.echo(f"{title}: and {len(listed) - _MAX_LINES} more", err=True)
