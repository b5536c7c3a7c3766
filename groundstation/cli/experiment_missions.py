"""`groundstation experiment missions`: healthy flights in random rooms, judged by truth until all stand."""

from pathlib import Path
from typing import Any

import click

from groundstation.cli.exits import ExitCode
from groundstation.cli.experiment_campaign import flights_option, flown_options, fly_all, order_of, publish
from groundstation.cli.numbers import FiniteRange

_BATCH = 10


@click.command(
    epilog="\b\nExamples:\n  groundstation experiment missions --flights 300\n"
    "  groundstation experiment missions --flights 30 --understated 1 --seed 500\n\n"
    "Exit codes: 0 all flew, within the fence and apart, and stand; 1 some did not; 2 wrong settings."
)
@click.option(
    "--understated",
    type=FiniteRange(1, 100),
    default=4.0,
    show_default=True,
    help="Factor by which every third flight understates the covariance of its sightings; 1: no flight does.",
)
@flights_option(30)
@flown_options("missions", seconds=30.0, least_s=5)
def missions(
    flights: int, seed: int, scheduler: str, workers: int, out: Path, as_json: bool, understated: float, **flown: Any
) -> int:
    """Fly complete flights in random rooms, with random pads and targets: take-off, tracking, landing.

    Rooms of 6 to 12 m by 5 to 8 m; targets stand, or drive on one of the scenarios' paths at 0.15 to 0.6 m/s. Nothing
    is wrong but the scenario's errors and, in every third flight, the stated covariance of sightings. By ground truth,
    from take-off to landing, the drones must stay within the fence and 0.6 m apart.
    """
    from groundstation.experiments.flight_batches import batches, flights_of
    from groundstation.experiments.missions import rows_of, table

    planned = batches(order_of(**flown, understated=understated), seed, flights, _BATCH, "missions")
    found, _ = flights_of(fly_all(planned, scheduler, workers, out))
    rows = rows_of(found)
    document = {"experiment": "missions", "rows": rows, "flights": found}
    publish(document, table(rows), out, as_json)
    amiss = any(row["violations"] or row["not_landed"] or row["not_flown"] for row in rows)
    return ExitCode.FAILED if amiss else ExitCode.OK
