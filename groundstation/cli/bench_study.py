"""`groundstation bench study`: speed of the study relative to real time, and CPU time of its parts."""

import json
import subprocess
import sys
from typing import Any

import click

from groundstation.cli.bench_limits import judge
from groundstation.cli.numbers import FiniteRange
from groundstation.errors import GroundStationError
from groundstation.process.one_thread import one_thread

# 40 times real time on one core: a campaign of 1000 flights of a minute in 25 minutes.
_LIMITS = {"cpu_ms_per_flight_s": 25.0}


@click.command(
    short_help="CPU of flights at message level, by part.", epilog="Example: groundstation bench study --runs 5 --json"
)
@click.option("--duration", type=FiniteRange(1, 600), default=45.0, show_default=True, help="Seconds of tracking.")
@click.option("--runs", type=click.IntRange(1, 100), default=3, show_default=True, help="Flights; the quickest counts.")
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON.")
def study(duration: float, runs: int, as_json: bool) -> int:
    """Time flights of two drones at message level, one after the other: CPU time of world, filter, planner, setpoints.

    Kernels are compiled before the first flight counts. Exit code 0 when the limit is kept, 1 when it is
    not.
    """
    _fly(1.0)
    flights = [_fly(duration) for _ in range(runs)]
    quickest = min(flights, key=lambda flight: float(flight["cpu_s"]["total"]))
    cpu_s, flown_s = quickest["cpu_s"], quickest["flown_s"]
    figures: dict[str, Any] = {
        "flown_s": flown_s,
        "times_real_time": round(flown_s / cpu_s["total"], 1),
        "cpu_ms_per_flight_s": {part: round(1e3 * value / flown_s, 1) for part, value in cpu_s.items()},
    }
    return judge(figures, _LIMITS, "total", as_json)


def _fly(seconds: float) -> dict[str, Any]:
    command = [sys.executable, "-m", "sim_bridge.study", "demo", "--duration", str(seconds), "--json"]
    result = subprocess.run(command, env=one_thread(), capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise GroundStationError(f"the study ended with exit code {result.returncode}: {result.stderr.strip()[-500:]}")
    flight: dict[str, Any] = json.loads(result.stdout)
    return flight
