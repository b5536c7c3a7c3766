"""`groundstation experiment culprits`: labs whose field file is wrong, and whether the right figure is blamed."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from groundstation.cli.exits import ExitCode
from groundstation.cli.experiment_campaign import (
    chosen_labs,
    flown_field,
    flown_scenario,
    fly_all,
    labs_options,
    publish,
)
from groundstation.errors import SettingsError

if TYPE_CHECKING:
    from groundstation.experiments.culprit_rows import WrongLab
    from groundstation.experiments.flight_batches import FlightBatch

_BATCH = 5
_SECONDS = 25.0


@click.command(
    epilog="\b\nExamples:\n  groundstation experiment culprits                       (every row, 5 seeds each)\n"
    "  groundstation experiment culprits --rows nothing --seeds 100\n"
    '  groundstation experiment culprits --rows "pan of one,all markers" --seeds 1 --json\n\n'
    "Exit codes: 0 in 9 of 10 flights of each row what is wrong was named, 1 it was not, 2 wrong settings."
)
@labs_options("culprits", seeds=5, seconds=None, least_s=5, usual=f"{_SECONDS:g}, or as long as the row needs")
def culprits(
    seeds: int, seed: int, only: str, scheduler: str, workers: int, out: Path, as_json: bool, **flown: Any
) -> int:
    """Fly labs that differ from their field file, and judge whether the operator is told what is wrong.

    In each row one thing is wrong: a delay, a camera's mounting, a marker's size, a lens, a pad, exchanged markers. The
    team stands on its pads for 4 s, is checked, and takes off whatever was found. The fault counts as named in time if
    a finding forbids the take-off for it, or if it alone is suspected, within 20 s of the command to take off.
    """
    from groundstation.experiments.culprits import row_of, table, verdict_on
    from groundstation.experiments.flight_batches import flights_of

    planned = _planned(only, seeds, seed, **flown)
    batches = [batch for _, own in planned for batch in own]
    found = iter(fly_all(batches, scheduler, workers, out))
    rows, flights = [], []
    for lab, own in planned:
        known = [one for _ in own for one in flights_of([next(found)])[0]]
        verdicts = [verdict_on(lab, one) for one in known]
        rows.append(row_of(lab, verdicts))
        flights += [
            {"lab": lab.name, **verdict, "told": one["told"]} for verdict, one in zip(verdicts, known, strict=True)
        ]
    document = {"experiment": "culprits", "rows": rows, "flights": flights}
    publish(document, table(rows), out, as_json)
    return ExitCode.OK if all(row["as_wanted"] >= 0.9 * row["flights"] for row in rows) else ExitCode.FAILED


def _planned(
    only: str, seeds: int, seed: int, seconds: float | None, field: str, scenario: str, options: tuple[str, ...]
) -> "list[tuple[WrongLab, list[FlightBatch]]]":
    """Return the batches of flights of each chosen row."""
    from groundstation.experiments.culprit_rows import labs_of
    from groundstation.experiments.flight_batches import batches
    from groundstation.settings.files import find_field

    path = find_field(field)
    order = flown_field(path, options)
    base = flown_scenario(scenario, path)
    if not order["field"]["cameras"] or len(order["field"]["drones"]) < 2:
        raise SettingsError([f"{path}: culprits needs a fixed camera and two drones"])
    labs = [(lab, _seconds(lab, seconds)) for lab in chosen_labs(only, labs_of(order["field"]))]
    return [
        (lab, batches(_order(order | {"seconds": flown_s}, base, lab), seed, seeds, _BATCH, "culprits"))
        for lab, flown_s in labs
    ]


def _seconds(lab: "WrongLab", told: float | None) -> float:
    """Return for how long the flights of a row track; raises UsageError if that is too short for a verdict."""
    from groundstation.experiments.culprits import WITHIN_S, needed_s

    least = needed_s(lab)
    if told is not None and told < least:
        begins = f"begins {lab.since_s:g} s after the order to take off and " if lab.since_s else ""
        what = f"row {lab.name!r} needs {least:g} or more: what is wrong {begins}must be named within {WITHIN_S:g} s"
        raise click.UsageError(f"--duration {told:g}: {what}")
    return max(_SECONDS, least) if told is None else told


def _order(order: dict[str, Any], base: dict[str, Any], lab: "WrongLab") -> str:
    """Return the simulator's order without the seeds."""
    cameras = {**(base.get("cameras") or {}), **(lab.cameras or {})}
    scenario = {**base, "cameras": cameras, "faults": list(lab.faults)}
    from groundstation.experiments.culprit_rows import STAND_S

    wrong = {"errors": lab.errors, "exchanged": lab.exchanged}
    times = {"stand_s": STAND_S, "diagnosed_from_s": lab.diagnosed_from_s}
    return json.dumps(order | wrong | times | {"scenario": scenario}, sort_keys=True)
