"""`groundstation bench ros2`: the cost of showing a flight to ROS 2."""

import click

from groundstation.cli.bench_limits import judge
from groundstation.cli.numbers import FiniteRange

_LIMITS = {"cpu_percent_of_core": 3.0}


@click.command(
    short_help="CPU of showing a flight to ROS 2.", epilog="Example: groundstation bench ros2 --seconds 20 --json"
)
@click.option("--seconds", type=FiniteRange(2, 600), default=20.0, show_default=True, help="How long to run [s].")
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON.")
def ros2(seconds: float, as_json: bool) -> int:
    """Let `view --ros2` show a made-up run of two drones with the demo's topics, rates and sizes; needs [ros2].

    Its cost is CPU time of all its threads. A busy machine makes that larger: its load, and the CPU time of 10 million
    turns of an empty Python loop, are printed. Exit code 0 when the limit is kept, 1 when it is not.
    """
    from groundstation.bench.ros2 import measure
    from groundstation.engineering_views.extras import require_ros2

    require_ros2()
    figures = {"seconds": seconds, **measure(seconds)}
    return judge(figures, _LIMITS, "", as_json)
