"""`groundstation bench ardrone`: CPU time of the AR.Drone codec, against a public client and a bare loop of structs."""

import json
from typing import Any

import click

from groundstation.cli.exits import ExitCode


@click.command(
    short_help="Time the AR.Drone codec against a public client's.",
    epilog="\b\nExample:\n  groundstation bench ardrone --json",
)
@click.option(
    "--count", type=click.IntRange(10, 1_000_000), default=2000, show_default=True, help="Calls in each round."
)
@click.option(
    "--rounds", type=click.IntRange(1, 1000), default=7, show_default=True, help="Number of rounds; the median counts."
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def ardrone(count: int, rounds: int, as_json: bool) -> int:
    """Time the AR.Drone codec in CPU time of one core.

    Exit code 1 if a full packet with all its options takes more than 60 us. pyardrone is timed if `make interop` has
    installed it.
    """
    from groundstation.bench.ardrone import LIMIT_US, measure

    result = measure(count, rounds)
    click.echo(json.dumps(result, indent=1) if as_json else _table(result))
    full = result["times"]["navdata: packet and all options"]["min_us"]
    return ExitCode.OK if full <= LIMIT_US else ExitCode.FAILED


def _table(result: dict[str, Any]) -> str:
    full = result["times"]["navdata: packet and all options"]["median_us"]
    lines = [f"{'':34} {'CPU us':>8} {'least':>8}   a packet of {result['packet_bytes']} bytes"]
    for name, row in result["times"].items():
        if row is None:
            lines.append(f"{name:34}        - (make interop installs it)")
            continue
        ratio = f"   {row['median_us'] / full:.2f} of ours" if name.startswith("peer") else ""
        lines.append(f"{name:34} {row['median_us']:8.1f} {row['min_us']:8.1f}{ratio}")
    return "\n".join([*lines, f"limit for packet and all options: {result['limit_us']:.0f} us"])
