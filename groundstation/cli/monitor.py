"""`groundstation monitor`: the live table of a run, from any terminal."""

import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from groundstation.cli.exits import UnreachableError

if TYPE_CHECKING:
    from groundstation.bus.api import Bus
    from groundstation.monitor.state import Cast
    from groundstation.supervisor.runtime_file import RuntimeRecord

_TURN_S = 0.084
_ONCE_S = 1.5  # every status is published at least once a second


@click.command(epilog="\b\nExamples:\n  groundstation monitor\n  groundstation monitor --once --json")
@click.option("--run", "name", metavar="NAME", help="The run to show, if there are several.")
@click.option("--once", is_flag=True, help="Print the state once and exit.")
@click.option("--json", "as_json", is_flag=True, help="Print the state as JSON and exit.")
def monitor(name: str | None, once: bool, as_json: bool) -> None:
    """Show a live table of a running ground station. Leaving it stops nothing."""
    from groundstation.bus.roles import Role
    from groundstation.supervisor.joining import join

    record = choose(name)
    bus = join(record, "monitor", Role.VIEW)
    try:
        if once or as_json:
            _print_once(bus, cast_of(record), as_json)
        else:
            _watch(bus, record)
    finally:
        bus.close()


def choose(name: str | None) -> "RuntimeRecord":
    """Return the run of that name, or the only one; raises UnreachableError naming all runs."""
    from groundstation.supervisor.runtime_file import live_records

    records = [record for record in live_records() if name in (None, record.name)]
    if not records:
        raise UnreachableError("no ground station is running here" + (f" as {name}" if name else ""))
    if len(records) > 1:
        raise UnreachableError(f"several runs are going on: add --run {' or --run '.join(r.name for r in records)}")
    return records[0]


def cast_of(record: "RuntimeRecord") -> "Cast":
    """Return drones and targets of a run, as far as its present recording has them."""
    from groundstation.field.resolved import field_from_json
    from groundstation.monitor.state import Cast, cast_from_field
    from groundstation.recording.reader import attached_field

    try:
        return cast_from_field(field_from_json(attached_field(Path(record.run_dir))))
    except ValueError:
        return Cast(record.site, dict.fromkeys(record.drones, 0.15))


def _watch(bus: "Bus", record: "RuntimeRecord") -> None:
    from groundstation.monitor.screen import Screen

    hint = "Ctrl-C leaves the monitor; the flight goes on"
    with Screen(bus, cast_of(record), time.monotonic_ns(), hint=hint) as screen:
        try:
            while record.alive:
                screen.turn(time.monotonic_ns())
                time.sleep(_TURN_S)
        except KeyboardInterrupt:
            return
    click.echo("the run has ended")


def _print_once(bus: "Bus", cast: "Cast", as_json: bool) -> None:
    from groundstation.monitor.screen import Screen

    screen = Screen(bus, cast, time.monotonic_ns())
    time.sleep(_ONCE_S)
    screen.listen()
    if as_json:
        click.echo(screen.state.as_json(time.monotonic_ns()))
        return
    from groundstation.cli.terminal import show
    from groundstation.monitor.table import render

    show(render(screen.state, time.monotonic_ns()))
