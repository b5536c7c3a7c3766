"""`groundstation host`: run the drivers and cameras that a field gives to this host."""

import os
import sys
from pathlib import Path

import click


@click.command(
    epilog="\b\nExamples:\n  groundstation host\n  groundstation host --site lab --output /var/log/skein\n\n"
    "Ctrl-C lands the drones of this host. Exit codes: 130 interrupted, 2 not a member of one site."
)
@click.option("--site", help="The site to serve, if this host has joined several.")
@click.option(
    "-o",
    "--output",
    "logs",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("hosted"),
    show_default=True,
    help="Folder for the logs of each run.",
)
@click.option("--one-run", "once", is_flag=True, help="End after the first run.")
def host(site: str | None, logs: Path, once: bool) -> int:
    """Run the devices of this host in each run of its site, until Ctrl-C.

    Those are the drones, cameras and motion capture systems whose `host` in the field file is the name by which the
    site admitted this computer (`groundstation site join`).
    """
    from groundstation.cli.exits import ExitCode
    from groundstation.flight.hosting import Hosting
    from groundstation.supervisor.site import membership
    from groundstation.supervisor.terminal import Terminal

    terminal = Terminal()
    hosting = Hosting(*membership(site), logs, terminal)
    interrupted = hosting.serve(hosting.wait())
    terminal.flush()
    if not interrupted and not once:
        # The next run has another clock and other processes: nothing of this run may remain.
        os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])
    return ExitCode.INTERRUPTED if interrupted else ExitCode.OK
