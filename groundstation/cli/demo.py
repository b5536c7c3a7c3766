"""`demo`: the lab of the method's Fig. 2 in the simulator, with the realistic scenario."""

from typing import Any

import click

from groundstation.cli.run import Rehearsal, run_simulated, simulated_options

DEFAULT_DURATION_S = 60.0


@click.command(
    epilog="\b\nExamples:\n  groundstation demo\n  groundstation demo --headless --duration 45 --seed 7\n\n"
    "Exit codes: 0 passed, 1 failed its criteria, 4 a process failed, 130 interrupted."
)
@simulated_options
def demo(**arguments: Any) -> int:
    """Two emulated AR.Drones track a TurtleBot for 60 s, and the run is judged. Needs no hardware.

    The run needs both topologies only from 30 s on: before, the target stays within the ceiling camera's reach.
    """
    if arguments["duration"] is None:
        arguments["duration"] = DEFAULT_DURATION_S
    return run_simulated("demo", "lab", Rehearsal(**arguments))
