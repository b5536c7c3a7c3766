"""`groundstation bench estimator`: CPU time of the joint filter against filterpy and numpy, and of its whole path."""

import json
import os
from typing import Any

import click

from groundstation.cli.exits import ExitCode
from groundstation.cli.kernels import use_all_kernels
from groundstation.cli.lists import numbers
from groundstation.cli.terminal import write_over


@click.command(
    short_help="Time the joint filter, its path, and peers.",
    epilog="\b\nExamples:\n  groundstation bench estimator\n  groundstation bench estimator --robots 30 --json",
)
@click.option("--robots", default="5,10,30", show_default=True, help="Team sizes; 30 are judged.")
@click.option(
    "--rounds",
    type=click.IntRange(2, 10_000),
    default=30,
    show_default=True,
    help="Number of rounds; the fastest counts.",
)
@click.option("--flight-ms", type=click.IntRange(200, 60_000), default=1000, show_default=True,
              help="Milliseconds of flight through the product's path.")  # fmt: skip
@click.option("--field", "field_name", default="lab", show_default=True, help="Field file whose first drone is copied.")
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Seed of beliefs and noise.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def estimator(robots: str, rounds: int, flight_ms: int, field_name: str, seed: int, as_json: bool) -> int:
    """Time the joint filter: a prediction of the team, a correction per edge, and an observation from bytes to bytes.

    CPU time of one core, the least of all rounds; a busy machine adds to it. Exit code 1 if 30 robots were timed and a
    required figure is missed, or if the filters do not agree.
    """
    sizes = numbers(robots, "--robots", 2, 40)
    use_all_kernels()  # before the field is read, whose planner may import kernels
    from groundstation.settings.files import find_field
    from groundstation.settings.load import load_field
    from groundstation.settings.resolved import resolved_field

    resolved = resolved_field(load_field(find_field(field_name), ()))
    if not resolved.drones or not resolved.cameras:
        raise click.UsageError(f"--field: {field_name} has no drone or no camera to copy")
    from groundstation.bench.estimator import SAME_BELIEF, run_bench

    result = run_bench(sizes, resolved, rounds, flight_ms, seed, write_over)
    write_over("")
    click.echo(json.dumps(result, indent=1) if as_json else _table(result))
    agree = all(
        d <= SAME_BELIEF for row in result["same_belief"].values() for n, d in row.items() if n != "numpy-batch"
    )
    met = agree and all(target["met"] for target in result["targets"].values())
    return ExitCode.OK if met else ExitCode.FAILED


def _table(result: dict[str, Any]) -> str:
    lines = ["kernels                                  predict us  correct us/edge    cores  times ours   differs by"]
    for row in result["kernels"]:
        name = f"{row['robots']:3} robots {row['blocks']:8} {row['dim']:4} {row['method']:11}"
        differs = result["same_belief"][str(row["robots"])].get(row["method"])
        lines.append(
            f"{name:40} {row['predict_us']:10.2f} {row['correct_us']:16.2f} {row['cores']:8.3f} "
            f"{row['times_ours']:11.1f}" + (f"   {differs:.0e}" if differs is not None else "")
        )
    lines += ["", "path: decode, intake, filter, Innovation        us/observation    observations  times in order"]
    for row in result["path"]:
        name = f"{row['robots']:3} robots {row['blocks']:8} {'heights' if row['heights'] else '-':8} "
        name += f"{row['delay_ms']:3} ms late" if row["delay_ms"] else "in order"
        name += f", waits {row['waits_ms']:.0f} ms" if row["waits_ms"] else ""
        lines.append(f"{name:47} {row['us_per_observation']:14.1f} {row['observations']:15} {row['to_in_order']:15.2f}")
    lines.append("")
    for name, target in result["targets"].items():
        bound = "at least" if name == "filterpy_to_ours" else "at most"
        lines.append(f"{name:26} {target['value']:8.2f}   {bound} {target['limit']:g}: {_word(target['met'])}")
    lines += result["missing"]
    return "\n".join([*lines, f"load average {result['load'][0]:.1f} on {os.cpu_count()} processors"])


def _word(met: bool) -> str:
    return "met" if met else "MISSED"
