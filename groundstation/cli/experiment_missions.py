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
    "  groundstation experiment missions --flights 30 --understated 1 --drift 0 --seed 500\n\n"
    "Exit codes: 0 all flew, within the fence and apart, and stand; 1 some did not; 2 wrong settings."
)
@click.option(
    "--understated",
    type=FiniteRange(1, 100),
    default=4.0,
    show_default=True,
    help="Factor by which every third flight understates the covariance of its sightings; 1: no flight does.",
)
@click.option(
    "--drift",
    "drift_m_s",
    type=FiniteRange(0, 1),
    default=0.05,
    show_default=True,
    help="Error of each drone's reported velocity in every third flight [m/s]; 0: in none.",
)
@flights_option(30)
@flown_options("missions", seconds=30.0, least_s=5)
def missions(flights: int, seed: int, scheduler: str, workers: int, out: Path, as_json: bool, **flown: Any) -> int:
    """Fly complete flights in random rooms, with random teams, pads and targets: take-off, tracking, landing.

    Rooms of 6 to 12 m by 5 to 8 m; two or more of the field's drones; targets stand, or drive on one of the scenarios'
    paths at 0.15 to 0.6 m/s. Of three flights, in one nothing is wrong but the scenario's errors; in one sightings
    state too small a covariance; in one drones drift and do not report it. By ground truth, from lift-off to the
    floor, the drones must stay within the fence, 0.6 m apart, and 0.3 m from the pillar that half of the rooms have.
    """
    from groundstation.experiments.flight_batches import batches, flights_of
    from groundstation.experiments.missions import rows_of, table

    planned = batches(order_of(**flown), seed, flights, _BATCH, "missions")
    found, _ = flights_of(fly_all(planned, scheduler, workers, out))
    rows = rows_of(found)
    document = {"experiment": "missions", "rows": rows, "flights": found}
    publish(document, table(rows), out, as_json)
    amiss = any(row["violations"] or row["not_landed"] or row["not_flown"] for row in rows)
    return ExitCode.FAILED if amiss else ExitCode.OK
