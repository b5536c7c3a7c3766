"""`groundstation recording`: inspects, repairs, cuts and exports recordings."""

import json
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from groundstation.cli.exits import ExitCode
from groundstation.cli.export import export
from groundstation.cli.numbers import FiniteRange

if TYPE_CHECKING:
    from groundstation.recording.info import RecordingInfo

EXISTING = click.Path(exists=True, path_type=Path)
_MAX_LINES = 20


@click.group(
    epilog="\b\nExamples:\n  groundstation recording info runs/20261120T101500Z-lab\n"
    "  groundstation recording cut runs/20261120T101500Z-lab --from 30 --to 45\n"
    "  groundstation recording export --csv runs/20261120T101500Z-lab",
)
def recording() -> None:
    """Inspect, repair, cut and convert recordings: a run folder, or one .mcap file of it."""


recording.add_command(export)


@recording.command()
@click.argument("recording", type=EXISTING)
@click.option("--json", "as_json", is_flag=True, help="Print everything as JSON.")
def info(recording: Path, as_json: bool) -> int:
    """Show parts, duration, topics with counts and rates, versions, holes and damage. Reads and checks everything."""
    from groundstation.recording.info import info_of
    from groundstation.recording.run import open_run

    found = info_of(open_run(recording))
    if as_json:
        click.echo(json.dumps(asdict(found) | {"whole": found.whole}, indent=2))
    else:
        _print(found)
    return ExitCode.OK


@recording.command()
@click.argument("recording", type=EXISTING)
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="New file (default: NAME-recovered.mcap beside it)."
)
def recover(recording: Path, output: Path | None) -> int:
    """Write a valid copy of a file that was cut off, for programs that refuse such files.

    Skein's own commands do not need it: they read a cut file as far as it is sound.
    """
    from groundstation.recording.copies import recover as make_valid
    from groundstation.recording.run import open_run

    run = open_run(recording)
    damaged = [index for index in run.indexes if index.checked_damage()]
    for path, why in run.unread.items():
        click.echo(f"{path}: nothing can be recovered: {why}", err=True)
    if not damaged and not run.unread:
        click.echo(f"{recording}: nothing is damaged, nothing was written")
    if output is not None and len(damaged) > 1:
        names = ", ".join(index.path.name for index in damaged)
        raise click.UsageError(f"several files are damaged ({names}): name one of them, or leave out --output.")
    for index in damaged:
        target = output or index.path.with_name(f"{index.path.stem}-recovered.mcap")
        count, damage = make_valid(index.path, target)
        click.echo(f"{target}: {count} messages of {index.path.name} ({'; '.join(damage)})")
    return ExitCode.SETTINGS if run.unread else ExitCode.OK


@recording.command()
@click.argument("recording", type=EXISTING)
@click.option("--from", "from_s", type=FiniteRange(0), default=0.0, help="Begin [s since the start].")
@click.option("--to", "to_s", type=FiniteRange(0), help="End [s since the start] (default: the end).")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="New folder, or file for a file (default: beside it)."
)
def cut(recording: Path, from_s: float, to_s: float | None, output: Path | None) -> int:
    """Copy a section of a recording to a new one, with all attachments and the state at its beginning."""
    from groundstation.recording.cut import cut_run
    from groundstation.recording.run import open_run

    run = open_run(recording)
    for path, count in cut_run(run, recording, from_s, to_s, output).items():
        click.echo(f"{path}: {count} messages")
    for line in run.damage:
        click.echo(f"damaged, read as far as it is sound: {line}", err=True)
    return ExitCode.OK


def _print(found: "RecordingInfo") -> None:
    began = datetime.fromtimestamp(found.start_unix_ns / 1e9, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    run, versions = found.metadata.get("run", {}), found.metadata.get("versions", {})
    click.echo(f"{began}, {found.duration_s:.1f} s, site {run.get('site', '?')}")
    seeds = ", ".join(f"{name} {value}" for name, value in found.metadata.get("seeds", {}).items())
    click.echo(f"by skein-groundstation {versions.get('skein-groundstation', '?')}{f'; {seeds}' if seeds else ''}")
    click.echo(f"attached: {', '.join(f'{name} ({size} B)' for name, size in found.attachments.items()) or 'nothing'}")
    click.echo()
    for part in found.parts:
        state = "; ".join(part.damage) or "whole"
        click.echo(f"{part.path}  {part.size_bytes / 1e6:.1f} MB  {part.messages} messages  {state}")
    click.echo()
    width = max((len(channel.channel) for channel in found.channels), default=7)
    click.echo(f"{'channel':{width}}  {'messages':>8}  {'Hz':>7}  {'longest gap':>11}  schema")
    for channel in found.channels:
        rate = f"{channel.rate_hz:.2f}" if channel.rate_hz else "-"
        click.echo(
            f"{channel.channel:{width}}  {channel.messages:8d}  {rate:>7}  "
            f"{channel.longest_gap_s:9.2f} s  {channel.schema}"
        )
    _print_troubles(found)


def _print_troubles(found: "RecordingInfo") -> None:
    holes = [f"{hole.channel}: {hole.from_s:.1f} s to {hole.to_s:.1f} s" for hole in found.holes]
    for title, lines in (
        ("Holes (silence of a regular topic)", holes),
        ("Parts that are missing", found.missing_parts),
        ("Messages that have changed since", found.changed_messages),
    ):
        if lines:
            click.echo(f"\n{title}:")
            click.echo("\n".join(f"  {line}" for line in lines[:_MAX_LINES]))
            if len(lines) > _MAX_LINES:
                click.echo(f"  and {len(lines) - _MAX_LINES} more (--json shows all)")
    if any(part.damage for part in found.parts):
        click.echo("\nWhat is sound of a damaged file is read all the same; `groundstation recording recover` makes a")
        click.echo("valid file of it for other programs.")
