"""`groundstation experiment faults`: many short flights with random faults, judged by truth."""

import time
from pathlib import Path
from typing import Any

import click

from groundstation.cli.exits import ExitCode
from groundstation.cli.experiment_campaign import flights_option, flown_options, fly_all, order_of, publish
from groundstation.cli.lists import parts


@click.command(
    epilog="\b\nExamples:\n  groundstation experiment faults --flights 200\n"
    "  groundstation experiment faults --flights 1 --seed 4711 --json    (one flight again, with what was said)\n"
    "  groundstation experiment faults --flights 100 --kinds velocity_stuck,telemetry_frozen\n\n"
    "Exit codes: 0 all flew and none ended unsafe, 1 some did not fly or ended unsafe, 2 wrong settings."
)
@click.option(
    "--kinds",
    default="",
    help="Only these kinds of faults, separated by commas (default: all that are drawn at random; body_turned and "
    "anchor_frozen are flown only if named); none: healthy flights.",
)
@flights_option(100)
@flown_options("faults", seconds=20.0, least_s=12)
def faults(
    flights: int, seed: int, scheduler: str, workers: int, out: Path, as_json: bool, kinds: str, **flown: Any
) -> int:
    """Fly random fields with one or two random faults, with the real drivers, watchdogs and tracker.

    At message level: no processes, no pictures. Each seed is one flight, and always ends in the same way. Unsafe are,
    from the first lift-off on: a separation below 0.6 m; a drone outside the fence, within 0.3 m of an obstacle of the
    field, 0.3 m/s above its speed limit, falling, or in motion for more than a second with a belief that is 0.5 m off;
    and, once a vehicle's telemetry is useless, no hover within 1 s, no rest within 3.5 s, or motion after it.
    """
    from groundstation.experiments.faults import by_kind, ends_told, table, totals
    from groundstation.experiments.flight_batches import batches, flights_of

    began = time.monotonic()
    order = order_of(**flown, kinds=parts(kinds))
    planned = batches(order, seed, flights, size=max(1, min(20, flights // max(1, 2 * workers or 4))))
    found, timing = flights_of(fly_all(planned, scheduler, workers, out))
    summary = totals(found, timing) | {"elapsed_s": round(time.monotonic() - began, 1)}
    by_kinds = by_kind(found)
    document = {"experiment": "faults", **summary, "kinds": by_kinds, "flights_flown": found}
    publish(document, [*table(by_kinds), *ends_told(summary), *_spent(summary, out)], out, as_json)
    return ExitCode.FAILED if summary["unsafe"] or summary["not_flown"] else ExitCode.OK


def _spent(summary: dict[str, Any], folder: Path) -> list[str]:
    shares = ", ".join(f"{name} {share:.0%}" for name, share in summary["time_shares"].items())
    return [
        f"{summary['cpu_s_per_flight']} s of CPU time for a flight ({shares}), {summary['elapsed_s']} s in all",
        f"written to {folder}/faults.json; one again: groundstation experiment faults --flights 1 --seed N --json",
    ]
