"""`groundstation experiment faults`: many short flights with random faults, judged by truth."""

import json
import time
from pathlib import Path
from typing import Any

import click

from groundstation.cli.exits import ExitCode
from groundstation.cli.experiment_campaign import campaign_options, fly_all, order_of
from groundstation.cli.numbers import FiniteRange


@click.command(
    epilog="\b\nExamples:\n  groundstation experiment faults --flights 200\n"
    "  groundstation experiment faults --flights 1 --seed 4711 --json    (one flight again, with what was said)\n"
    "  groundstation experiment faults --flights 100 --kinds velocity_stuck,telemetry_frozen\n\n"
    "Exit codes: 0 no unsafe end, 1 unsafe ends, 2 wrong settings."
)
@click.option(
    "--flights",
    type=click.IntRange(1),
    default=100,
    show_default=True,
    help="Number of flights, each with a seed of its own.",
)
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Seed of the first flight.")
@click.option(
    "--duration",
    "seconds",
    type=FiniteRange(12, 600),
    default=20.0,
    show_default=True,
    help="Seconds of tracking in each flight.",
)
@click.option("--field", "name", default="lab", show_default=True, help="Field file, or a shipped one's name.")
@click.option("--scenario", default="realistic", show_default=True, help="Scenario without faults: sensor errors.")
@click.option(
    "--kinds",
    default="",
    help="Only these kinds of faults, separated by commas (default: all that are drawn at random); none: healthy "
    "flights.",
)
@campaign_options("faults")
def faults(
    flights: int, seed: int, scheduler: str, workers: int, out: Path, as_json: bool, kinds: str, **flown: Any
) -> int:
    """Fly random fields with one or two random faults, with the real drivers, watchdogs and tracker.

    At message level: no processes, no pictures. Each seed is one flight, and always ends in the same way. Unsafe are: a
    separation below 0.6 m; a drone outside the fence, 0.3 m/s above its speed limit, or in motion for more than a
    second with a belief that is 0.5 m off; and, once a vehicle's telemetry is useless, no hover within 1 s or no rest
    within 3.5 s.
    """
    from groundstation.experiments.faults import batches, by_kind, ends_told, flights_of, table, totals
    from groundstation.experiments.runner import write_atomically

    began = time.monotonic()
    order = order_of(**flown, kinds=[kind.strip() for kind in kinds.split(",") if kind.strip()])
    planned = batches(order, seed, flights, size=max(1, min(20, flights // max(1, 2 * workers or 4))))
    found, timing = flights_of(fly_all(planned, scheduler, workers, flights == 1, out))
    summary = totals(found, timing) | {"elapsed_s": round(time.monotonic() - began, 1)}
    by_kinds = by_kind(found)
    document = {"experiment": "faults", **summary, "kinds": by_kinds, "flights_flown": found}
    write_atomically(out / "faults.json", json.dumps(document, indent=1) + "\n")
    if as_json:
        click.echo(json.dumps(document, indent=1))
    else:
        _tell([*table(by_kinds), *ends_told(summary)], summary, out)
    return ExitCode.FAILED if summary["unsafe"] else ExitCode.OK


def _tell(lines: list[str], summary: dict[str, Any], folder: Path) -> None:
    for line in lines:
        click.echo(line)
    shares = ", ".join(f"{name} {share:.0%}" for name, share in summary["time_shares"].items())
    click.echo(f"{summary['cpu_s_per_flight']} s of CPU time for a flight ({shares}), {summary['elapsed_s']} s in all")
    click.echo(
        f"written to {folder}/faults.json; one again: groundstation experiment faults --flights 1 --seed N --json"
    )
