"""`groundstation experiment`: seeded studies in the plane, of flights at message level, and of recorded data."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from groundstation.cli.experiment_calibrations import calibrations
from groundstation.cli.experiment_culprits import culprits
from groundstation.cli.experiment_faults import faults
from groundstation.cli.experiment_missions import missions
from groundstation.cli.experiment_mrclam import mrclam
from groundstation.cli.experiment_scenarios import scenarios
from groundstation.cli.kernels import use_all_kernels
from groundstation.cli.lists import choices, numbers
from groundstation.cli.numbers import FiniteRange
from groundstation.cli.terminal import progress
from groundstation.errors import GroundStationError

if TYPE_CHECKING:
    from groundstation.experiments.tasks import Task

_STRATEGIES = ("paper", "certified", "global", "fixed-string", "fixed-flat", "fixed-two-level", "random")
_STARTS = ("string", "two-level", "flat", "random")


def _option(*names: str, **settings: Any) -> Callable[[Callable[..., None]], Callable[..., None]]:
    return click.option(*names, show_default=True, **settings)


def _world(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options every experiment of runs has."""
    for option in (
        click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON."),
        click.option("--figures/--no-figures", default=True, help="Draw pictures and an animation."),
        _option(
            "-o",
            "--output",
            "out",
            type=click.Path(path_type=Path),
            default=None,
            help="Folder of the results (default: runs/experiment-NAME).",
        ),
        _option("--kidnap", type=FiniteRange(0, 1), default=0.0, help="Probability per step that the target jumps."),
        _option("--dropout", type=FiniteRange(0, 1), default=0.0, help="Share of readings lost."),
        _option("--first-seed", type=click.IntRange(0), default=1, help="First seed; the others count up from it."),
    ):
        command = option(command)
    return command


@click.group(epilog="Example: groundstation experiment figure1 --seeds 5")
def experiment() -> None:
    """Seeded experiments: the paper's planar simulations, flights at message level, and a real data set.

    The planar ones write results.csv (one row per run), summary.json, timing.json and pictures into their folder, the
    others one file of figures.
    """


experiment.add_command(mrclam)
experiment.add_command(faults)
experiment.add_command(culprits)
experiment.add_command(calibrations)
experiment.add_command(missions)
experiment.add_command(scenarios)


@experiment.command()
@_option("--robots", type=click.IntRange(1, 100), default=5, help="Team size.")
@_option("--strategies", default="paper,certified", help=f"Strategies, of {', '.join(_STRATEGIES)}.")
@_option("--seeds", type=click.IntRange(1), default=50, help="Number of runs of each.")
@_world
def figure1(robots: int, strategies: str, seeds: int, **world: Any) -> None:
    """A team follows a target that leaves the global sensor: string, two levels, three levels."""
    chosen = choices(strategies, _STRATEGIES, "--strategies")
    tasks = _tasks("figure1", [robots], chosen, ["string"], seeds, world)
    _finish("figure1", tasks, world)


@experiment.command()
@_option("--robots", default="2,3,5,8,10,20,30", help="Team sizes.")
@_option("--strategies", default="paper,certified,fixed-two-level", help=f"Strategies, of {', '.join(_STRATEGIES)}.")
@_option("--starts", default="string", help=f"First topologies, of {', '.join(_STARTS)}.")
@_option("--seeds", type=click.IntRange(1), default=20, help="Number of runs of each.")
@_world
def teams(robots: str, strategies: str, starts: str, seeds: int, **world: Any) -> None:
    """Teams of 2 to 100 robots and a receding target: uncertainty relative to the paper's heuristic."""
    sizes = numbers(robots, "--robots", 1, 100)
    chosen = choices(strategies, _STRATEGIES, "--strategies")
    tasks = _tasks("teams", sizes, chosen, choices(starts, _STARTS, "--starts"), seeds, world)
    _finish("teams", tasks, world)


@experiment.command("figure-eight")
@_option("--robots", default="2,3,5", help="Team sizes.")
@_option("--strategies", default="paper,certified,fixed-string", help=f"Strategies, of {', '.join(_STRATEGIES)}.")
@_option("--seeds", type=click.IntRange(1), default=20, help="Number of runs of each.")
@_world
def figure_eight(robots: str, strategies: str, seeds: int, **world: Any) -> None:
    """The target walks a figure of eight at 0.3 m/s, as in the authors' program.

    `certified` fuses whatever is in view and needs a gain of 15 % to switch; the others fuse the topology's edges only,
    as the paper does.
    """
    sizes = numbers(robots, "--robots", 1, 100)
    chosen = choices(strategies, _STRATEGIES, "--strategies")
    tasks = _tasks("figure-eight", sizes, chosen, ["string"], seeds, world)
    _finish("figure-eight", tasks, world)


@experiment.command()
@_option("--robots", type=click.IntRange(2, 7), default=5, help="Team size.")
@_option("--seeds", type=click.IntRange(1), default=5, help="Number of runs of each sensor and topology.")
@_world
def sensors(robots: int, seeds: int, **world: Any) -> None:
    """Which topology wins with which sensor: ranges, growing noise, bearings, ranges only, displaced disc."""
    if world["dropout"] or world["kidnap"]:
        raise click.UsageError("sensors knows neither --dropout nor --kidnap")
    use_all_kernels()
    from groundstation.experiments.runner import write_atomically
    from groundstation.experiments.sensors import compare
    from groundstation.experiments.tasks import csv_text

    folder = _folder("sensors", world)
    rows = compare(robots, range(world["first_seed"], world["first_seed"] + seeds))
    write_atomically(folder / "results.csv", csv_text([{"row": row} for row in rows], ("row",)))
    winners = [row for row in rows if row["wins"]]
    summary = {"experiment": "sensors", "robots": robots, "winners": winners}
    write_atomically(folder / "summary.json", json.dumps(summary, indent=1) + "\n")
    if world["figures"]:
        from groundstation.experiments.charts import save_sensors

        save_sensors(folder / "sensors.png", rows)
    _show(summary, winners, folder, world)


@experiment.command()
@_option(
    "--experiment",
    "name",
    type=click.Choice(["figure1", "teams", "figure-eight"]),
    default="teams",
    help="The experiment.",
)
@_option("--robots", default="2,5,10,20", help="Team sizes.")
@_option("--strategies", default="paper,certified", help=f"Strategies, of {', '.join(_STRATEGIES)}.")
@_option("--starts", default="string,two-level,random", help=f"First topologies, of {', '.join(_STARTS)}.")
@_option("--seeds", type=click.IntRange(1), default=20, help="Number of runs of each.")
@_option("--scheduler", default="local", help="tcp://host:8786 of a dask cluster, `local`, or `none`.")
@_option("--workers", type=click.IntRange(0), default=0, help="Processes of the local cluster; 0: one per core.")
@_world
def sweep(
    name: str, robots: str, strategies: str, starts: str, seeds: int, scheduler: str, workers: int, **world: Any
) -> None:
    """Many runs on a dask cluster; each result is a file, so the same call goes on where it was stopped."""
    from groundstation.experiments.runner import dask_is_there

    sizes = numbers(robots, "--robots", 1, 100)
    chosen, first = choices(strategies, _STRATEGIES, "--strategies"), choices(starts, _STARTS, "--starts")
    tasks = _tasks(name, sizes, chosen, first, seeds, world)
    if scheduler == "local" and not dask_is_there():
        click.echo("dask is not installed (pip install 'skein-groundstation[sweep]'): running one by one", err=True)
        scheduler = "none"
    _finish("sweep", tasks, world, "" if scheduler == "none" else scheduler, workers)


def _tasks(
    name: str,
    robots: Sequence[int],
    strategies: Sequence[str],
    starts: Sequence[str],
    seeds: int,
    world: dict[str, Any],
) -> "list[Task]":
    """Return all runs of a grid; only `certified` and `global` depart from the paper."""
    use_all_kernels()  # the next import compiles
    from groundstation.experiments.tasks import DEPARTURES, Task

    if "global" in strategies and max(robots) > 6:
        raise click.UsageError("--strategies: global searches all topologies, which ends at 6 robots")
    seeded = range(world["first_seed"], world["first_seed"] + seeds)
    return [
        Task(
            name, n, strategy, seed, start, dropout=world["dropout"], kidnap=world["kidnap"],
            **(DEPARTURES[name] if strategy in ("certified", "global") else {}),
        )
        for n in robots
        for strategy in strategies
        for start in (starts if not strategy.startswith(("fixed", "random")) else starts[:1])
        for seed in seeded
    ]  # fmt: skip


def _finish(name: str, tasks: "list[Task]", world: dict[str, Any], scheduler: str = "", workers: int = 0) -> None:
    """Run the tasks, write the tables and pictures, and print the result."""
    from groundstation.experiments.runner import SweepError, run_tasks, write_atomically
    from groundstation.experiments.summary import add_ratios, summarise, timings
    from groundstation.experiments.tasks import csv_text

    folder = _folder(name, world)
    try:
        rows = run_tasks(tasks, folder / "tasks" if name == "sweep" else None, scheduler, workers, progress)
    except SweepError as error:
        raise GroundStationError(str(error)) from error
    entries = summarise(rows)
    add_ratios(entries)
    summary = {"experiment": name, "groups": entries}
    write_atomically(folder / "results.csv", csv_text(rows))
    write_atomically(folder / "summary.json", json.dumps(summary, indent=1) + "\n")
    write_atomically(folder / "timing.json", json.dumps(timings(rows), indent=1) + "\n")
    if world["figures"]:
        from groundstation.experiments.gallery import draw

        draw(folder, tasks, rows, entries)
    _show(summary, entries, folder, world)


def _folder(name: str, world: dict[str, Any]) -> Path:
    """Make the folder of the results and return it; done first, so that it cannot fail after hours of computing."""
    folder = Path(world["out"] or Path("runs") / f"experiment-{name}")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _show(summary: dict[str, Any], entries: Sequence[dict[str, Any]], folder: Path, world: dict[str, Any]) -> None:
    if world["as_json"]:
        click.echo(json.dumps(summary, indent=1))
        return
    for entry in entries:
        parts = (f"{key} {value:.4g}" if isinstance(value, float) else f"{key} {value}" for key, value in entry.items())
        click.echo(", ".join(part for part in parts if not part.startswith("experiment ")))
    click.echo(f"written to {folder}/")
