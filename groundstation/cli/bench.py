"""`groundstation bench`: long measurements, each a sub-command imported only when it is called."""

from pkgutil import resolve_name

import click

# name -> (module:function, line in the help); a new bench is one row here and one module beside this one.
BENCHES = {
    "demo": ("groundstation.cli.bench_demo:demo", "Fly many seeds of the demo and judge each."),
    "vision": ("groundstation.cli.bench_vision:vision", "Measure markers and detector on rendered pictures."),
    "ardrone": ("groundstation.cli.bench_ardrone:ardrone", "Time the AR.Drone codec against a public client's."),
    "planner": ("groundstation.cli.bench_planner:planner", "Time the planar planner against brute force and peers."),
    "mavlink": ("groundstation.cli.bench_mavlink:mavlink", "CPU and delays of driving many MAVLink vehicles."),
    "estimator": ("groundstation.cli.bench_estimator:estimator", "Time the joint filter, its path, and peers."),
    "recording": ("groundstation.cli.bench_recording:recording", "CPU of writing, opening and seeking recordings."),
    "bus": ("groundstation.cli.bench_bus:bus", "Time round trips over the bus, plain and guarded."),
    "console": ("groundstation.cli.bench_console:console", "CPU and delays of the operator's page."),
    "ros2": ("groundstation.cli.bench_ros2:ros2", "CPU of showing a flight to ROS 2."),
    "study": ("groundstation.cli.bench_study:study", "CPU of flights at message level, by part."),
}


class BenchGroup(click.Group):
    """Sub-commands from the table above."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names in the order of the table."""
        return list(BENCHES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return a bench, importing its module now; None for an unknown name."""
        row = BENCHES.get(cmd_name)
        if row is None:
            return None
        command = resolve_name(row[0])
        assert isinstance(command, click.Command)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the table without importing any bench."""
        with formatter.section("Benches"):
            formatter.write_dl([(name, summary) for name, (_, summary) in BENCHES.items()])


@click.group(cls=BenchGroup, epilog="Example: groundstation bench demo --seeds 10")
def bench() -> None:
    """Measure performance, and judge it."""
