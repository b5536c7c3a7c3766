"""`groundstation bench planner`: one control step of the planar planner, timed against brute force and peers."""

import json
from typing import Any

import click

from groundstation.cli.kernels import use_all_kernels
from groundstation.cli.lists import choices, numbers
from groundstation.cli.numbers import FiniteRange
from groundstation.cli.terminal import write_over

_LAYOUTS = ("two-level", "random", "string", "flat")
_PEERS = ("naive", "numpy", "jax")


@click.command(short_help="Time the planar planner against brute force and peers.")
@click.option("--robots", default="2,5,10,20,30,50,100", show_default=True, help="Team sizes.")
@click.option("--layout", default="two-level,random,string", show_default=True, help=f"Of {', '.join(_LAYOUTS)}.")
@click.option("--peer", default="", help=f"Also time {', '.join(_PEERS)} (comma-separated), each in a child process.")
@click.option(
    "--repeats",
    type=click.IntRange(1, 1000),
    default=9,
    show_default=True,
    help="Number of rounds; each runs all peers.",
)
@click.option("--seed", type=click.IntRange(0), default=3, show_default=True, help="Seed of the beliefs.")
@click.option("--limit", "limit_s", type=FiniteRange(0.1), default=20.0, show_default=True, help="Seconds a peer "
              "may take for one step; beyond it the rest is extrapolated and marked.")  # fmt: skip
@click.option(
    "--model",
    type=click.Choice(["planar", "frustum"]),
    default="planar",
    show_default=True,
    help="The planner of the experiments, or that which flies.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def planner(
    robots: str, layout: str, peer: str, repeats: int, seed: int, limit_s: float, model: str, as_json: bool
) -> None:
    """Time one control step of a planner: CPU time of one core, median of interleaved rounds.

    The planner that flies is timed on fresh beliefs and on those of a team in flight; for it, --robots, --layout
    (without random), --repeats and --seed count.
    """
    sizes, layouts = numbers(robots, "--robots", 1, 500), choices(layout, _LAYOUTS, "--layout")
    peers = choices(peer, _PEERS, "--peer") if peer else []
    if model == "frustum":
        layouts = _of_the_planner_that_flies(layouts, peers)
    use_all_kernels()
    from groundstation.bench.planner import run_bench

    if model == "frustum":
        from groundstation.bench.frustum import run_frustum_bench

        timed = run_frustum_bench(sizes, layouts, repeats, seed, tell=write_over)
        write_over("")
        click.echo(json.dumps(timed, indent=1) if as_json else _frustum_table(timed))
        return
    result = run_bench(sizes, layouts, peers, repeats, seed, limit_s, write_over)
    write_over("")
    click.echo(json.dumps(result, indent=1) if as_json else _table(result))


def _of_the_planner_that_flies(layouts: list[str], peers: list[str]) -> list[str]:
    """Return the layouts to time the planner that flies in; raises UsageError for none, or if peers are named."""
    if peers:
        raise click.UsageError("--peer: the planner that flies (--model frustum) has no peers")
    chosen = [one for one in layouts if one != "random"]
    if not chosen:
        raise click.UsageError("--layout: the planner that flies (--model frustum) has no teams of random levels")
    return chosen


def _frustum_table(result: dict[str, Any]) -> str:
    lines = [
        f"{'layout':10} {'robots':>6} {'belief':8} {'CPU ms':>8} {'p99':>8} {'topol.':>6} {'solved':>6} {'eval.':>6} "
        f"{'gap':>5} {'over ms':>8}"
    ]
    for row in result["rows"]:
        lines.append(
            f"{row['layout']:10} {row['robots']:6} {row['belief']:8} {row['cpu_ms_median']:8.2f} "
            f"{row['cpu_ms_p99']:8.2f} {row['topologies']:6} {row['solved']:6.0%} {row['evaluations']:6} "
            f"{row['gap']:5.2f} {row['over_ms']:8.2f}"
        )
    lines.append(f"over ms: beyond a budget of {result['budget_ms']:g} ms at most (negative: done before)")
    return "\n".join(lines)


def _table(result: dict[str, Any]) -> str:
    header = f"{'layout':10} {'robots':>6} {'method':14} {'CPU ms':>11} {'min':>10} {'max':>10} {'topol.':>6} "
    lines = [header + f"{'solved':>6} {'eval.':>9} {'same':>5} {'MB':>5}"]
    for row in result["rows"]:
        if row["cpu_ms_median"] is None:
            lines.append(f"{row['layout']:10} {row['robots']:6} {row['method']:14} {row['failure']}")
            continue
        star = "*" if row["extrapolated"] else " "
        same = {True: "yes", False: "no", None: "-"}[row["matches_brute_force"]]
        lines.append(
            f"{row['layout']:10} {row['robots']:6} {row['method']:14} {row['cpu_ms_median']:10.3f}{star} "
            f"{row['cpu_ms_min']:10.3f} {row['cpu_ms_max']:10.3f} {row['topologies']:6} {row['survivors']:6} "
            f"{row['evaluations']:9} {same:>5} {row['peak_memory_mb']:5.0f}"
        )
    for layout, slopes in result["exponent"].items():
        lines.append(f"exponent {layout}: " + ", ".join(f"{method} {value:.2f}" for method, value in slopes.items()))
    return "\n".join([*lines, "* partly extrapolated: some topologies or one evaluation, times exact counts"])
