"""The shared part of experiments that fly batches of message-level flights: options, field, and the runs."""

import json
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from groundstation.cli.lists import choices
from groundstation.cli.numbers import FiniteRange
from groundstation.cli.terminal import progress
from groundstation.errors import GroundStationError

if TYPE_CHECKING:
    from groundstation.experiments.culprit_rows import WrongLab
    from groundstation.experiments.flight_batches import FlightBatch

Command = TypeVar("Command", bound=Callable[..., Any])


def campaign_options(name: str) -> Callable[[Command], Command]:
    """Return a decorator with the options of a campaign; its results go to runs/experiment-NAME."""
    return _all_of(
        click.option(
            "--set", "options", multiple=True, metavar="A.B=C", help="Override one setting of the field; repeatable."
        ),
        click.option(
            "--scheduler",
            default="local",
            show_default=True,
            help="tcp://host:8786 of a dask cluster, `local`, or `none`.",
        ),
        click.option(
            "--workers", type=click.IntRange(0), default=0, help="Processes of the local cluster; 0: one per core."
        ),
        click.option(
            "-o",
            "--output",
            "out",
            type=click.Path(path_type=Path),
            default=Path("runs") / f"experiment-{name}",
            show_default=True,
            help="Folder of the results.",
        ),
        click.option("--json", "as_json", is_flag=True, help="Print all flights as JSON."),
    )


def flown_options(
    name: str, seconds: float | None, least_s: float, usual: str | bool = True
) -> Callable[[Command], Command]:
    """Return a decorator with the options of a campaign that flies one field under one scenario.

    seconds: the default of tracking in each flight [s], which takes least_s or more; usual: that default in words.
    """
    return _all_of(
        click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Seed of the first flight."),
        click.option(
            "--duration",
            "seconds",
            type=FiniteRange(least_s, 600),
            default=seconds,
            show_default=usual,
            help="Seconds of tracking in each flight.",
        ),
        click.option("--field", default="lab", show_default=True, help="Field file, or a shipped one's name."),
        click.option(
            "--scenario", default="realistic", show_default=True, help="Scenario: sensor errors, the target's path."
        ),
        campaign_options(name),
    )


def flights_option(flights: int) -> Callable[[Command], Command]:
    """Return the option that says how many flights a campaign has."""
    return click.option(
        "--flights",
        type=click.IntRange(1),
        default=flights,
        show_default=True,
        help="Number of flights, each with a seed of its own.",
    )


def labs_options(
    name: str, seeds: int, seconds: float | None, least_s: float, usual: str | bool = True
) -> Callable[[Command], Command]:
    """Return a decorator with the options of a campaign over rows of wrong labs; seeds: default of flights in a row."""
    return _all_of(
        click.option(
            "--seeds", type=click.IntRange(1, 1000), default=seeds, show_default=True, help="Flights of each row."
        ),
        click.option(
            "--rows", "only", default="", metavar="NAMES", help="Only these rows, separated by commas (default: all)."
        ),
        flown_options(name, seconds, least_s, usual),
    )


def _all_of(*options: Callable[[Command], Command]) -> Callable[[Command], Command]:
    def decorated(command: Command) -> Command:
        for option in reversed(options):
            command = option(command)
        return command

    return decorated


def flown_field(path: Path, options: Sequence[str]) -> dict[str, Any]:
    """Return the simulator's order for a field: its resolved values, and the sections of its vehicle drivers."""
    import msgspec

    from groundstation.settings.load import load_field
    from groundstation.settings.resolved import resolved_field
    from groundstation.settings.sections import CAMERA, driver_sections

    field = load_field(path, (*options, "recording.raw_datagrams=false"))
    sections = [(s.kind, s.section) for s in driver_sections(field) if s.kind != CAMERA]
    return {"field": msgspec.to_builtins(resolved_field(field)), "sections": sections}


PICTURES_ONLY = (
    "pixel_noise",
    "blur_px",
    "exposure_ms",
    "rolling_shutter_ms",
    "light",
    "shot_noise",
    "jpeg_quality",
    "floor",
)
"""Keys of a scenario's cameras that matter in pictures only, which are not drawn at message level."""


@cache
def flown_scenario(name: str, field: Path) -> dict[str, Any]:
    """Return a scenario for flights at message level; prints which of its settings have no effect there.

    field: the field file beside which the scenario is searched.
    """
    from groundstation.settings.document import read
    from groundstation.settings.files import SHIPPED, find_scenario
    from groundstation.settings.scenario import load_scenario

    scenario = load_scenario(find_scenario(name, field))
    usual = read(SHIPPED / "scenarios" / "realistic.yaml").plain()["cameras"]
    told = scenario.get("cameras") or {}
    if idle := [key for key in PICTURES_ONLY if told.get(key, usual[key]) != usual[key]]:
        listed = ", ".join(f"cameras.{key}" for key in idle)
        click.echo(f"{name}: {listed}: nothing of it at message level, where no pictures are drawn: fly it", err=True)
    return scenario


def order_of(field: str, scenario: str, options: Sequence[str], seconds: float, **own: Any) -> str:
    """Return the simulator's order without the seeds, by names of field and scenario; own: keys of one study only."""
    from groundstation.settings.files import find_field

    path = find_field(field)
    order = {"scenario": flown_scenario(scenario, path), "seconds": seconds}
    return json.dumps(flown_field(path, options) | order | own, sort_keys=True)


def chosen_labs(only: str, labs: "Sequence[WrongLab]") -> "list[WrongLab]":
    """Return the labs of the named rows, of all for ""; raises UsageError for an unknown name."""
    known = {lab.name: lab for lab in labs}
    return [known[name] for name in (choices(only, known, "--rows") if only else known)]


def fly_all(batches: "Sequence[FlightBatch]", scheduler: str, workers: int, out: Path) -> list[dict[str, Any]]:
    """Return the row of each batch; a single one needs no local cluster. Raises GroundStationError.

    Each row is kept in a folder of `out`, so that an interrupted campaign can be continued. Prints in which flights
    planning failed.
    """
    from groundstation.experiments.flight_batches import CampaignError, flights_of, fly
    from groundstation.experiments.runner import SweepError, dask_is_there, run_tasks

    (out / "flights").mkdir(parents=True, exist_ok=True)  # fails before hours of flights, not after
    serial = scheduler == "none" or (scheduler == "local" and (len(batches) == 1 or not dask_is_there()))
    try:
        rows = run_tasks(batches, out / "flights", "" if serial else scheduler, workers, progress, fly)
    except (SweepError, CampaignError) as error:
        raise GroundStationError(str(error)) from error
    if failed := [one for one in flights_of(rows)[0] if one.get("planning")]:
        seeds = " ".join(map(str, dict.fromkeys(one["seed"] for one in failed)))
        click.echo(f"seeds {seeds}: {failed[0]['planning']}; without a plan drones that track hover", err=True)
    return rows


def publish(document: dict[str, Any], lines: Iterable[str], out: Path, as_json: bool) -> None:
    """Write a campaign's document to its folder, and print it: as JSON, or its lines."""
    from groundstation.experiments.runner import write_atomically

    text = json.dumps(document, indent=1)
    write_atomically(out / f"{document['experiment']}.json", text + "\n")
    click.echo(text if as_json else "\n".join(lines))
