"""`groundstation experiment calibrations`: wrong field files, mended by `calibrate team` and flown again."""

import json
from dataclasses import dataclass
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
    from groundstation.experiments.culprit_rows import WrongFigure, WrongLab
    from groundstation.experiments.flight_batches import FlightBatch

Flight = dict[str, Any]


@click.command(
    epilog="\b\nExamples:\n  groundstation experiment calibrations                   (every row, 1 seed each)\n"
    '  groundstation experiment calibrations --rows "pan of both,all markers" --seeds 3\n\n'
    "Exit codes: 0 all flights keep their limits with the new settings, 1 one does not, 2 wrong settings."
)
@labs_options("calibrations", seeds=1, seconds=60.0, least_s=20)
def calibrations(
    seeds: int, seed: int, only: str, scheduler: str, workers: int, out: Path, as_json: bool, **flown: Any
) -> int:
    """Fly labs whose field file is wrong, apply what `calibrate team` proposes, and fly them again.

    Prints for both flights, of the same seed, the target's error and ANEES, and the errors left in the field file.
    """
    from groundstation.experiments.calibrations import row_of, table, verdict_on

    told = Told(**flown)
    labs, seeds_flown = _chosen(told, only), range(seed, seed + seeds)
    batches = [_batch(order, one) for order in (_order(told, lab.errors) for lab in labs) for one in seeds_flown]
    before = _flights(fly_all(batches, scheduler, workers, out))
    again = [
        _batch(_mended(told, lab, flight, out), flight["seed"])
        for lab, flight in zip((lab for lab in labs for _ in seeds_flown), before, strict=True)
    ]
    after = _flights(fly_all(again, scheduler, workers, out))
    rows, verdicts = [], []
    for index, lab in enumerate(labs):
        own = slice(index * seeds, (index + 1) * seeds)
        found = [verdict_on(lab, one, two) for one, two in zip(before[own], after[own], strict=True)]
        rows.append(row_of(lab, found))
        verdicts += [{"lab": lab.name, **one} for one in found]
    document = {"experiment": "calibrations", "rows": rows, "flights": verdicts}
    publish(document, table(rows), out, as_json)
    good = all(one["mended"] and not one["missed"] for one in verdicts)
    return ExitCode.OK if good else ExitCode.FAILED


@dataclass(frozen=True, slots=True)
class Told:
    """The operator's field, and the options of its flights."""

    field: str
    options: tuple[str, ...]
    scenario: str
    seconds: float

    @property
    def path(self) -> Path:
        """Return its file."""
        from groundstation.settings.files import find_field

        return find_field(self.field)


def _chosen(told: Told, only: str) -> "list[WrongLab]":
    from groundstation.experiments.calibrations import calibrated_labs
    from groundstation.experiments.culprit_rows import labs_of

    values = flown_field(told.path, told.options)["field"]
    if not values["cameras"] or len(values["drones"]) < 2:
        raise SettingsError([f"{told.field}: calibrations needs a fixed camera and two drones"])
    return chosen_labs(only, calibrated_labs(labs_of(values)))


def _order(told: Told, errors: "tuple[WrongFigure, ...]", mended: Path | None = None) -> str:
    """Return the simulator's order without the seeds; mended: the field's file with the new settings."""
    from groundstation.experiments.culprit_rows import STAND_S

    base = flown_scenario(told.scenario, told.path)
    own = {"errors": errors, "stand_s": STAND_S, "calibrate": mended is None, "scenario": base, "seconds": told.seconds}
    return json.dumps(flown_field(mended or told.path, told.options) | own, sort_keys=True)


def _batch(order: str, seed: int) -> "FlightBatch":
    from groundstation.experiments.flight_batches import FlightBatch

    return FlightBatch(order, (seed,), "calibrations")


def _flights(rows: list[dict[str, Any]]) -> list[Flight]:
    from groundstation.experiments.flight_batches import flights_of

    return flights_of(rows)[0]


def _mended(told: Told, lab: "WrongLab", flight: Flight, out: Path) -> str:
    """Return the order of the same flight with the proposed settings in the field file's text."""
    from groundstation.calibration.team_left import errors_left
    from groundstation.settings.load import load_field
    from groundstation.settings.patched import write_patched
    from groundstation.settings.resolved import resolved_field, yaml_of

    field = load_field(told.path, told.options)
    target = out / "fields" / f"{lab.name.replace(' ', '-')}-{flight['seed']}.yaml"
    target.parent.mkdir(parents=True, exist_ok=True)
    changes = {tuple(path): value for path, value in flight["settings"]}
    write_patched(target, yaml_of(field), changes, field.model_dump(mode="json"))
    left = errors_left(lab.errors, resolved_field(field), resolved_field(load_field(target, told.options)))
    return _order(told, left, target)
