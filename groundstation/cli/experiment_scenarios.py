"""`groundstation experiment scenarios`: the scenario files, flown at message level under several strategies."""

import json
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from groundstation.cli.exits import ExitCode
from groundstation.cli.experiment_campaign import campaign_options, flown_field, flown_scenario, fly_all, publish
from groundstation.cli.lists import choices
from groundstation.cli.numbers import FiniteRange

if TYPE_CHECKING:
    from groundstation.experiments.flight_batches import FlightBatch

_BATCH = 5


@click.command(
    epilog="\b\nExamples:\n  groundstation experiment scenarios                     (all of them, one seed each)\n"
    "  groundstation experiment scenarios random-walk kidnap-2m --seeds 20 --workers 4\n"
    "  groundstation experiment scenarios corridor-2 --seeds 5 --strategies ours,string,relay\n"
    "  groundstation experiment scenarios my_lab/scenarios/hard.yaml --field my_lab/lab.yaml\n\n"
    "Exit codes: 0 all flights were as expected, 1 some were not, 2 wrong settings."
)
@click.argument("names", nargs=-1)
@click.option("--seeds", type=click.IntRange(1, 1000), default=1, show_default=True, help="Flights of each scenario.")
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Seed of the first flight.")
@click.option(
    "--strategies",
    default="ours",
    show_default=True,
    help="Strategies, of ours,string,reversed,flat,two-level,no-topology,relay,chase,sampling,lattice,first-program.",
)
@click.option(
    "--duration", "seconds", type=FiniteRange(5, 3600), help="Seconds of tracking in each (default: as its file)."
)
@click.option(
    "--field", default=None, help="Field file, or a shipped one's name; default: as the scenario's file says."
)
@campaign_options("scenarios")
def scenarios(
    names: tuple[str, ...], strategies: str, scheduler: str, workers: int, out: Path, as_json: bool, **flown: Any
) -> int:
    """Fly scenario files at message level, and compare the results with what each file expects.

    NAMES: files, or names of shipped ones; none: all shipped ones that say what they expect. Drivers, watchdogs,
    estimator and planner are those that fly. Strategies beside ours: fixed topologies (string, the same reversed, flat,
    two-level), the best of which the others are compared with afterwards; no-topology (one solve, all sightings
    count); the relay rule (the drone nearest to the target stays 0.9 m from it on the side of the ceiling camera's
    view, the others look at it from there) and the chase (the nearest drone goes there from its own side); random
    sampling and a lattice of motions, by the same cost; and the method's first program (discs with a hard edge, every
    neighbour from rest, only the topology's sightings are fused). Figures count from when the target was found; lost
    is an error above 0.5 m.
    """
    from groundstation.experiments.flight_batches import flights_of
    from groundstation.experiments.scenarios import STRATEGIES, against_best_fixed, comparison, rows_of, table

    planned, began = _planned(names, choices(strategies, STRATEGIES, "--strategies"), **flown), time.monotonic()
    found = fly_all([batch for _, batch in planned], scheduler, workers, out)
    flights = [
        {"scenario": name, **one, "plan_ms": round(1e3 * spent["plan"], 2)}
        for (name, _), row in zip(planned, found, strict=True)
        for one, spent in zip(*flights_of([row]), strict=True)
    ]
    rows, best = rows_of(flights), against_best_fixed(flights)
    document = {
        "experiment": "scenarios",
        "elapsed_s": round(time.monotonic() - began, 1),
        "rows": rows,
        "against_best_fixed": best,
        "flights": flights,
    }
    publish(document, [*table(rows), *comparison(best), *_missed(rows, out)], out, as_json)
    return ExitCode.FAILED if any(row["missed"] for row in rows) else ExitCode.OK


def _planned(
    names: tuple[str, ...], strategies: list[str], seeds: int, seed: int, seconds: float | None, field: str | None,
    options: tuple[str, ...],
) -> "list[tuple[str, FlightBatch]]":  # fmt: skip
    """Return each batch of flights with its scenario's name: some seeds of a scenario under a strategy each."""
    from groundstation.experiments.flight_batches import batches

    planned = []
    for name, label in _labelled(names or _shipped()).items():
        order = _order(name, seconds, field, options)
        for strategy in strategies:
            text = json.dumps(order | {"strategy": strategy}, sort_keys=True)
            flights = batches(text, seed, seeds, _BATCH, "scenarios")
            planned += [(label, flight) for flight in flights]
    return planned


def _labelled(names: Sequence[str]) -> dict[str, str]:
    """Return each scenario's name in the table: its file's name, or its path as given if two share that."""
    short = {name: Path(name).name.removesuffix(".yaml") for name in names}
    shared = Counter(short.values())
    return {name: one if shared[one] == 1 else name for name, one in short.items()}


def _shipped() -> list[str]:
    """Return the names of the shipped scenarios with expectations."""
    from groundstation.settings.document import read
    from groundstation.settings.files import SHIPPED

    files = sorted((SHIPPED / "scenarios").glob("*.yaml"))
    return [file.stem for file in files if isinstance(tree := read(file).value, dict) and "expected" in tree]


def _order(name: str, seconds: float | None, field: str | None, options: tuple[str, ...]) -> dict[str, Any]:
    """Return the simulator's order without strategy and seeds."""
    from groundstation.settings.files import find_field

    scenario = flown_scenario(name, find_field(field or "lab"))
    expected = scenario.get("expected") or {}
    path = find_field(field or expected.get("field", "lab"))
    return flown_field(path, (*expected.get("set", ()), *options)) | {
        "scenario": scenario,
        "seconds": seconds or expected.get("seconds", 45.0),
    }


def _missed(rows: list[dict[str, Any]], folder: Path) -> list[str]:
    missed = [
        f"{row['scenario']} {row['strategy']} seed {seed}: {'; '.join(why)}"
        for row in rows
        for seed, why in row["missed"].items()
    ]
    return [*missed, f"written to {folder}/scenarios.json"]
