"""`groundstation bench vision`: runs the simulator's study of markers and detector in a process of its own."""

import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

import click

from groundstation.process.one_thread import one_thread


@click.command(
    short_help="Measure markers and detector on rendered pictures.",
    epilog="\b\nExamples:\n  groundstation bench vision\n"
    "  groundstation bench vision --pictures 250 -o runs/vision\n"
    "  groundstation bench vision --json | jq .targets",
)
@click.option(
    "--pictures",
    type=click.IntRange(8, 10_000),
    default=60,
    show_default=True,
    help="Pictures in each cell of the tables.",
)
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Seed of the pictures.")
@click.option(
    "-o",
    "--output",
    "out",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for figures and plots (default: in ./runs).",
)
@click.option("--json", "as_json", is_flag=True, help="Print all figures as JSON.")
def vision(pictures: int, seed: int, out: Path | None, as_json: bool) -> int:
    """Measure the detector on rendered pictures, beside OpenCV's: detection rates, pose errors, their covariance,
    identities, CPU.

    Exit code 0 only if every required figure is met. Takes some minutes.
    """
    folder = out or Path("runs") / f"vision-{datetime.now(UTC):%Y%m%dT%H%M%SZ}"
    command = [sys.executable, "-m", "sim_bridge.study", "vision", "--pictures", str(pictures), "--seed", str(seed)]
    command += ["--output", str(folder), *(["--json"] if as_json else [])]
    code = subprocess.run(command, env=one_thread(), check=False).returncode
    if not as_json:
        click.echo(f"figures and plots: {folder}", err=True)
    return code
