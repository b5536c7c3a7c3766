"""`groundstation experiment mrclam`: the estimator on real data of five robots, against motion capture."""

import dataclasses
import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from groundstation.cli.kernels import use_all_kernels

if TYPE_CHECKING:
    from groundstation.experiments.mrclam.run import ScenarioErrors

_FOLDER = click.Path(exists=True, file_okay=False, path_type=Path)


@click.command(epilog="Example: groundstation experiment mrclam ../shared/data/mrclam7")
@click.argument("folder", type=_FOLDER)
@click.option(
    "--seed", type=click.IntRange(0), default=1, show_default=True, help="Seed of the emulated camera's noise."
)
@click.option(
    "--span",
    type=(float, float),
    default=(0.0, 1.0),
    show_default=True,
    help="Part of the data set, as shares of its length.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the results as JSON.")
def mrclam(folder: Path, seed: int, span: tuple[float, float], as_json: bool) -> None:
    """Run the joint filter over a set of the UTIAS multi-robot localisation data (plain .dat files or .dat.xz).

    Each scenario without and with the readings between robots; errors are those of all robots against motion capture.
    """
    if not 0.0 <= span[0] < span[1] <= 1.0:
        raise click.UsageError("--span: two shares between 0 and 1, the smaller one first")
    use_all_kernels()
    from groundstation.experiments.mrclam.dataset import read_dataset
    from groundstation.experiments.mrclam.run import run_scenario
    from groundstation.experiments.mrclam.scenarios import SCENARIOS

    dataset = read_dataset(folder)
    results = []
    for scenario in SCENARIOS:
        for robot_readings in (False, True):
            results.append(run_scenario(dataset, scenario, robot_readings, seed=seed, span=span))
            if not as_json:
                click.echo(_line(results[-1]))
    if as_json:
        rows = [dataclasses.asdict(result) | {"lost": result.lost} for result in results]
        click.echo(json.dumps({"experiment": "mrclam", "folder": str(folder), "results": rows}, indent=1))


def _line(result: "ScenarioErrors") -> str:
    readings = "with" if result.robot_readings else "without"
    return (
        f"{result.scenario:33} {readings:>7} readings between robots: {result.rmse_m:.3f} m {result.rmse_deg:4.1f} deg,"
        f" at most {result.largest_m:.2f} m, ANEES {result.anees:.2f}{', LOST' if result.lost else ''}"
    )
