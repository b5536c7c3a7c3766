"""`groundstation bench bus`: the cost of certificates and access list for a round trip."""

from typing import Any

import click

from groundstation.cli.bench_limits import judge
from groundstation.cli.numbers import FiniteRange

_LIMITS = {"ratio_p50": 1.3}


@click.command(
    short_help="Time round trips over the bus, plain and guarded.", epilog="Example: groundstation bench bus --json"
)
@click.option("--trips", type=click.IntRange(10, 100_000), default=3000, show_default=True, help="Round trips per bus.")
@click.option("--rate", type=FiniteRange(1, 1000), default=300.0, show_default=True, help="Rate of each [Hz].")
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON.")
def bus(trips: int, rate: float, as_json: bool) -> int:
    """Time round trips tracker - router - driver and back: plain, and by turns with TLS and a traced access list.

    Exit code 0 when the limit is kept, 1 when it is not.
    """
    from groundstation.bench.bus import measure

    figures: dict[str, Any] = {"trips": trips, **measure(trips, rate)}
    return judge(figures, _LIMITS, "guarded / plain", as_json)
