"""`groundstation bench recording`: cost of writing, opening and seeking, compared with a plain MCAP library."""

import tempfile
from pathlib import Path

import click

from groundstation.cli.bench_limits import judge
from groundstation.cli.numbers import FiniteRange

_LIMITS = {"write_percent_of_core": 8.0, "open_s": 1.0, "seek_s": 0.2}


@click.command(
    short_help="CPU of writing, opening and seeking recordings.",
    epilog="Example: groundstation bench recording --minutes 2 --json",
)
@click.option("--minutes", type=FiniteRange(0.1, 120), default=10.0, show_default=True, help="Length of the run.")
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Seed of the made-up run.")
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON.")
def recording(minutes: float, seed: int, as_json: bool) -> int:
    """Write, open and seek a synthetic run with the topics and rates of the demo's. All figures are CPU time.

    Exit code 0 when all limits are kept, 1 when one is not.
    """
    from groundstation.bench.recording import measure

    with tempfile.TemporaryDirectory(prefix="skein-bench-") as folder:
        figures = measure(Path(folder), minutes * 60.0, seed)
    return judge(figures, _LIMITS, "", as_json)
