"""`groundstation replay`: plays a recorded run in the console, or re-runs it with today's tracker."""

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from groundstation.cli.exits import ExitCode
from groundstation.cli.numbers import FiniteRange

if TYPE_CHECKING:
    from groundstation.replay.source import Source

_RUNS = Path("runs")
_RERUN_ONLY = {"as_json": "--json", "output": "--output"}


class _Recording(click.Path):
    """The path of a recording; a file after `--json`, an old spelling, is answered with the present one."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if ctx is not None and ctx.params.get("as_json") and Path(value).suffix == ".json":
            self.fail(f"--json prints: write --json > {value}", param, ctx)
        return super().convert(value, param, ctx)


@click.command(
    epilog="\b\nExamples:\n  groundstation replay                                    the newest run, in the console\n"
    "  groundstation replay runs/20261120T101500Z-lab --from 30 --speed 2\n"
    "  groundstation replay RUN --recompute                    is today's tracker the recorded one, to the bit?\n"
    "  groundstation replay RUN --set estimator.gate_probability=0.99 --set planner.horizon_steps=5\n"
    "  groundstation replay RUN --estimator other.yaml --output what-if\n\n"
    "Exit codes: 0 done, or identical; 1 the re-run differs; 2 wrong usage, settings, or nothing that can be replayed."
)
@click.argument("recording", nargs=-1, type=_Recording(exists=True, path_type=Path))
@click.option("--recompute", is_flag=True, help="Feed the recorded inputs to today's tracker and compare.")
@click.option("--rerun", type=click.Choice(["tracker"]), hidden=True, help="Older spelling of --recompute.")
@click.option("--set", "options", multiple=True, metavar="A.B=C", help="Re-run with another setting; repeatable.")
@click.option(
    "--estimator",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Re-run with the estimator section of a field file.",
)
@click.option("--json", "as_json", is_flag=True, is_eager=True, help="Print the comparison of a re-run as JSON.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Write a re-run as a run folder, for report and replay."
)
@click.option("--port", type=click.IntRange(1024, 65535), help="Port to serve on (default: the field's console.port).")
@click.option("--from", "from_s", type=FiniteRange(0), help="Begin this many seconds after the recording's start.")
@click.option("--speed", type=FiniteRange(0.1, 20), help="Speed relative to the recorded one (default: 1).")
@click.option("--paused", is_flag=True, help="Wait until play is pressed on the page.")
@click.option("--until-end", is_flag=True, help="End with the recording, instead of waiting for the page.")
def replay(recording: tuple[Path, ...], recompute: bool, rerun: str | None, **options: Any) -> int:
    """Play a recorded run in the console as if it were live, or re-run its tracker and compare.

    RECORDING is a run folder, or the .mcap files of one (default: the newest run in ./runs).
    """
    from groundstation.cli.report import newest_run
    from groundstation.recording.reader import RecordingError
    from groundstation.replay.source import open_source

    if rerun:
        click.echo("--rerun tracker is --recompute now; --rerun still works here", err=True)
    again = recompute or rerun or options["options"] or options["estimator"]
    idle = [spelling for name, spelling in _RERUN_ONLY.items() if options[name]]
    if idle and not again:
        raise click.UsageError(f"{', '.join(idle)} belongs to a re-run: add --recompute")
    try:
        source = open_source(recording or (newest_run(_RUNS),))
        return _run_again(source, **options) if again else _play(source, **options)
    except RecordingError as error:
        raise click.UsageError(str(error)) from error


def _play(
    source: "Source",
    *,
    port: int | None,
    from_s: float | None,
    speed: float | None,
    paused: bool,
    until_end: bool,
    **_rerun: Any,
) -> int:
    import asyncio

    from groundstation.console.server import HOST
    from groundstation.process.ports import holder_of
    from groundstation.replay.playback import Playback
    from groundstation.replay.playback_server import serve

    playback = Playback(source, speed or 1.0, from_s or 0.0, playing=not paused or until_end)
    if from_s and from_s > playback.reel.duration_s:
        raise click.UsageError(f"--from {from_s:g}: the recording has {playback.reel.duration_s:.1f} s")
    click.echo(f"replay of {source.name}: {playback.reel.duration_s:.1f} s")
    for damage in playback.reel.damage:
        click.echo(f"damaged, and shown as far as it is sound: {damage}")

    def announce(url: str) -> None:
        if port and f":{port}/" not in url:
            click.echo(f"port {port} is taken by {holder_of(HOST, port)}")
        click.echo(f"{url} (Ctrl-C leaves it)")

    with suppress(KeyboardInterrupt):
        asyncio.run(serve(playback, port, until_end, announce))
    return ExitCode.OK


def _run_again(
    source: "Source",
    *,
    options: tuple[str, ...],
    estimator: Path | None,
    as_json: bool,
    output: Path | None,
    **playing: Any,
) -> int:
    from groundstation.cli.kernels import use_flying_kernels
    from groundstation.settings.recorded import recorded_field
    from groundstation.settings.resolved import resolved_field

    given = [f"--{name.removesuffix('_s').replace('_', '-')}" for name, value in playing.items() if value]
    if given:
        raise click.UsageError(f"{', '.join(given)} belongs to playing in the console, not to a re-run")
    field = resolved_field(recorded_field(source.field))
    changed = resolved_field(recorded_field(source.field, options, estimator))
    use_flying_kernels()
    from groundstation.replay.rerun_report import Again

    changes = [*([f"estimator of {estimator}"] if estimator else []), *options]
    again = Again(source, field, changed, changes, output)
    result = again.run()
    for line in [again.as_json(result).decode()] if as_json else again.lines(result):
        click.echo(line)
    return ExitCode.OK if changes or result.identical else ExitCode.FAILED
