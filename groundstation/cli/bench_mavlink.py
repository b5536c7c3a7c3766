"""`groundstation bench mavlink`: cost of driving many vehicles, and delays of telemetry and setpoints."""

from typing import Any

import click

from groundstation.cli.bench_limits import judge
from groundstation.cli.numbers import FiniteRange

_LIMITS = {"discovery_s": 2.0, "cores": 0.6, "telemetry_to_bus_ms": 3.0, "setpoint_to_wire_ms": 5.0}


@click.command(
    short_help="CPU and delays of driving many MAVLink vehicles.",
    epilog="Example: groundstation bench mavlink --link mavsdk --json",
)
@click.option("--vehicles", type=click.IntRange(1, 50), default=10, show_default=True, help="Number of vehicles.")
@click.option("--seconds", type=FiniteRange(1, 600), default=10.0, show_default=True, help="How long to run [s].")
@click.option(
    "--link",
    type=click.Choice(["pymavlink", "mavsdk"]),
    default="pymavlink",
    show_default=True,
    help="Library of the link.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON.")
def mavlink(vehicles: int, seconds: float, link: str, as_json: bool) -> int:
    """Drive emulated vehicles (each sends odometry at 50 Hz and IMU at 100 Hz, all on one port) in TRACK at 20 Hz.

    Cores are CPU time of the driver alone. Delays are wall time: a busy machine shows in them, so its load is printed.
    Exit code 0 when all limits are kept, 1 when one is not.
    """
    from groundstation.bench.mavlink import measure, peer

    figures: dict[str, Any] = {"vehicles": vehicles, "link": link, **measure(link, vehicles, seconds)}
    theirs = peer(vehicles, seconds)
    figures["peer"] = {"name": "pymavlink mavutil, receive only", **theirs}
    figures["ratio_to_peer"] = round(figures["us_per_frame"] / theirs["us_per_frame"], 2)
    return judge(figures, _LIMITS, "p99", as_json)
