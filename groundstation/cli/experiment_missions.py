"""`groundstation experiment missions`: healthy flights in random rooms, judged by truth until all stand."""

import json
from pathlib import Path
from typing import Any

import click

from groundstation.cli.exits import ExitCode
from groundstation.cli.experiment_campaign import campaign_options, fly_all, order_of
from groundstation.cli.numbers import FiniteRange

_BATCH = 10


@click.command(
    epilog="\b\nExamples:\n  groundstation experiment missions --flights 300\n"
    "  groundstation experiment missions --flights 30 --understated 1 --seed 500\n\n"
    "Exit codes: 0 all flew, within the fence and apart, and stand; 1 some did not; 2 wrong settings."
)
@click.option(
    "--flights",
    type=click.IntRange(1),
    default=30,
    show_default=True,
    help="Number of flights, each with a seed of its own.",
)
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Seed of the first flight.")
@click.option(
    "--understated",
    type=FiniteRange(1, 100),
    default=4.0,
    show_default=True,
    help="Factor by which every third flight understates the covariance of its sightings; 1: no flight does.",
)
@click.option(
    "--duration", "seconds", type=FiniteRange(5, 600), default=30.0, show_default=True, help="Seconds of tracking."
)
@click.option("--field", "name", default="lab", show_default=True, help="Field file, or a shipped one's name.")
@click.option("--scenario", default="realistic", show_default=True, help="Scenario: sensor errors.")
@campaign_options("missions")
def missions(
    flights: int, seed: int, scheduler: str, workers: int, out: Path, as_json: bool, understated: float, **flown: Any
) -> int:
    """Fly complete flights in random rooms, with random pads and targets: take-off, tracking, landing.

    Rooms of 6 to 12 m by 5 to 8 m; targets stand, or drive on one of the scenarios' paths at 0.15 to 0.6 m/s. Nothing
    is wrong but the scenario's errors and, in every third flight, the stated covariance of sightings. By ground truth,
    from take-off to landing, the drones must stay within the fence and 0.6 m apart.
    """
    from groundstation.experiments.faults import batches, flights_of
    from groundstation.experiments.missions import rows_of, table
    from groundstation.experiments.runner import write_atomically

    planned = batches(order_of(**flown, understated=understated), seed, flights, _BATCH, "missions")
    found, _ = flights_of(fly_all(planned, scheduler, workers, len(planned) == 1, out))
    rows = rows_of(found)
    document = {"experiment": "missions", "rows": rows, "flights": found}
    write_atomically(out / "missions.json", json.dumps(document, indent=1) + "\n")
    click.echo(json.dumps(document, indent=1) if as_json else "\n".join(table(rows)))
    amiss = any(row["violations"] or row["not_landed"] or row["not_flown"] for row in rows)
    return ExitCode.FAILED if amiss else ExitCode.OK
