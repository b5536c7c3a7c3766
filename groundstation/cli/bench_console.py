"""`groundstation bench console`: cost of the page's server, and age of an estimate when it is sent and drawn."""

import shutil
from typing import Any

import click

from groundstation.cli.bench_limits import judge
from groundstation.cli.numbers import FiniteRange

_CHROMIUM = ("chromium", "chromium-browser", "google-chrome")
_LIMITS = {
    "cpu_percent_of_core": 5.0,
    "estimate_to_socket_ms": 60.0,
    "estimate_to_drawn_ms": 60.0,
    "order_to_bus_ms": 20.0,
}


@click.command(
    short_help="CPU and delays of the operator's page.",
    epilog="Example: groundstation bench console --seconds 20 --json",
)
@click.option("--seconds", type=FiniteRange(2, 600), default=20.0, show_default=True, help="How long to run [s].")
@click.option("--drones", type=click.IntRange(1, 20), default=4, show_default=True, help="Number of drones that send.")
@click.option("--no-browser", is_flag=True, help="Leave out what needs Chromium.")
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON.")
def console(seconds: float, drones: int, no_browser: bool, as_json: bool) -> int:
    """Feed a console with a team's messages and two cameras' pictures at 5 Hz, and look at it once as a page does.

    The server's cost is CPU time. Delays are medians of wall time: a busy machine shows in them, so its load is
    printed. Exit code 0 when all limits are kept, 1 when one is not.
    """
    from groundstation.bench.console import measure

    browser = "" if no_browser else next(filter(None, map(shutil.which, _CHROMIUM)), "")
    figures: dict[str, Any] = {"drones": drones, "seconds": seconds, **measure(seconds, drones, _pictures(), browser)}
    figures["ratio_to_peer"] = round(figures["cpu_percent_of_core"] / figures["peer"]["cpu_percent_of_core"], 2)
    return judge(figures, _LIMITS, "median", as_json)


def _pictures() -> list[bytes]:
    """Return eight JPEGs of coarse noise like those that a camera's driver publishes, some 50 kB each."""
    import numpy as np

    from drivers.camera.sources.frames import Matrix

    noise = np.random.default_rng(1)
    coarse = noise.integers(60, 180, (8, 60, 80, 3), dtype=np.uint8)
    return [Matrix(picture.repeat(6, axis=0).repeat(8, axis=1)).jpeg() for picture in coarse]
