"""`groundstation bench`: long measurements; each of its commands in a module of its own."""

import click

from groundstation.cli.bench_ardrone import ardrone
from groundstation.cli.bench_bus import bus
from groundstation.cli.bench_console import console
from groundstation.cli.bench_demo import demo
from groundstation.cli.bench_estimator import estimator
from groundstation.cli.bench_mavlink import mavlink
from groundstation.cli.bench_planner import planner
from groundstation.cli.bench_recording import recording
from groundstation.cli.bench_ros2 import ros2
from groundstation.cli.bench_study import study
from groundstation.cli.bench_vision import vision


@click.group(epilog="Example: groundstation bench demo --seeds 10")
def bench() -> None:
    """Measure performance, and judge it."""


for command in (demo, vision, ardrone, planner, mavlink, estimator, recording, bus, console, ros2, study):
    bench.add_command(command)
