"""The table of verbs: module and function of each command, and its line in the help."""

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from groundstation.vehicles import KindCommands


class CommandRow(NamedTuple):
    """One row: family, place (`module:function`), line in the help, and whether it stands on the first page."""

    family: str
    target: str
    summary: str
    first: bool = False


VERBS: dict[str, CommandRow] = {
    "demo": CommandRow(
        "Fly", "groundstation.cli.demo:demo", "Two emulated drones track a TurtleBot; needs no hardware.", first=True
    ),
    "sitl": CommandRow(
        "Fly", "groundstation.cli.run:sitl", "Fly a field file against emulated drones and cameras.", first=True
    ),
    "fly": CommandRow("Fly", "groundstation.cli.run:fly", "Fly a field file with the real drones.", first=True),
    "host": CommandRow("Fly", "groundstation.cli.host:host", "Run the devices of this host in the runs of its site."),
    "takeoff": CommandRow("Fly", "groundstation.cli.stop:takeoff", "Take off, one drone after the other."),
    "track": CommandRow("Fly", "groundstation.cli.stop:track", "Let the tracker move the drones."),
    "resume": CommandRow(
        "Fly", "groundstation.cli.stop:resume", "Track again after a hold or a restart of the tracker."
    ),
    "hold": CommandRow("Stop", "groundstation.cli.stop:hold", "Let all drones hover, or the named ones.", first=True),
    "land": CommandRow("Stop", "groundstation.cli.stop:land", "Land all drones, or the named ones.", first=True),
    "cut-motors": CommandRow(
        "Stop", "groundstation.cli.stop:cut_motors", "Stop the motors at once: the drones fall.", first=True
    ),
    "deadman": CommandRow(
        "Stop", "groundstation.cli.deadman:deadman", "Dead man's handle: let go, and all drones hold, then land."
    ),
    "monitor": CommandRow(
        "Look", "groundstation.cli.monitor:monitor", "Live table of a running ground station.", first=True
    ),
    "console": CommandRow(
        "Look", "groundstation.cli.console:console", "The operator's web page of a running ground station.", first=True
    ),
    "report": CommandRow(
        "Look", "groundstation.cli.report:report", "Rebuild the report of a recorded run, or compare runs.", first=True
    ),
    "replay": CommandRow(
        "Look", "groundstation.cli.replay:replay", "Play a recorded run in the console, or recompute it.", first=True
    ),
    "view": CommandRow("Look", "groundstation.cli.view:view", "Live engineering view in Rerun, Foxglove or ROS 2."),
    "recording": CommandRow(
        "Look", "groundstation.cli.recording:recording", "Inspect, repair, cut and convert recordings."
    ),
    "export": CommandRow(
        "Look", "groundstation.cli.export:export", "Write a recorded run in the formats of other programs."
    ),
    "new": CommandRow("Prepare", "groundstation.cli.new:new", "Write a field file from a few questions.", first=True),
    "config": CommandRow(
        "Prepare", "groundstation.cli.config:config", "Check, show, draw or create a field file.", first=True
    ),
    "doctor": CommandRow("Prepare", "groundstation.cli.doctor:doctor", "Check what this machine lacks for flying."),
    "forecast": CommandRow(
        "Prepare", "groundstation.cli.forecast:forecast", "Predict how well the target will be known in a flight."
    ),
    "preflight": CommandRow(
        "Prepare", "groundstation.cli.preflight:preflight", "Check, without flying, what forbids a take-off."
    ),
    "calibrate": CommandRow(
        "Prepare", "groundstation.cli.calibrate:calibrate", "Measure lenses, mountings and delays."
    ),
    "camera": CommandRow(
        "Prepare", "groundstation.cli.camera:camera", "Show a camera's pictures and the markers found in them."
    ),
    "markers": CommandRow("Prepare", "groundstation.cli.markers:markers", "Print the markers of robots and targets."),
    "vehicle": CommandRow("Prepare", "groundstation.cli.vehicle:vehicle", "List, check and identify vehicles."),
    "site": CommandRow("Prepare", "groundstation.cli.site:site", "Admit other hosts to the runs of a site."),
    "experiment": CommandRow(
        "Study", "groundstation.cli.experiment:experiment", "Seeded experiments: planar, flights, recorded data."
    ),
    "bench": CommandRow(
        "Develop", "groundstation.cli.bench:bench", "Measure flights, planner, estimator, bus and page."
    ),
    "version": CommandRow(
        "Develop", "groundstation.cli.version:version", "Versions of this program and its libraries."
    ),
}


def of_kinds() -> dict[str, CommandRow]:
    """Return the rows that kinds of vehicles add; a name of this table stays with this table."""
    rows = {}
    for name, commands in _commands_of_kinds().items():
        if name not in VERBS:
            rows[name] = CommandRow("Prepare", commands.target, commands.summary)
    return rows


def all_verbs() -> dict[str, CommandRow]:
    """Return all rows: the table's, then those of kinds of vehicles, whose objects are imported for it."""
    return VERBS | of_kinds()


def meant(word: str) -> str:
    """Return the commands meant by a word of another ground station or by a sub-command's name, or ""."""
    below = [f"'{name} {word}'" for name, commands in _commands_of_kinds().items() if word in commands.words]
    return ELSEWHERE.get(word) or " or ".join(below)


def _commands_of_kinds() -> "dict[str, KindCommands]":
    # Imported here only: commands that stop drones must not wait for it.
    from groundstation.vehicles import all_kinds

    return {name: kind.commands for name, kind in all_kinds().items() if kind.commands is not None}


ELSEWHERE = {
    **dict.fromkeys(("stop", "halt", "abort", "emergency", "kill"), "'land', 'hold' or 'cut-motors'"),
    **dict.fromkeys(("start", "run", "launch"), "'sitl' or 'fly'"),
    **{word: f"'config {word}'" for word in ("check", "init", "show", "draw", "schema")},
    **{word: f"'recording {word}'" for word in ("info", "recover", "cut")},
    "compare": "'report RUN --compare OTHER'",
    "print": "'markers print'",
    "record": "'recording' (each run is recorded by itself)",
}
"""Words of other ground stations, and those that stand one level down here: the likeness of letters would mislead."""

RENAMED = {
    "replay": {"--headless": "--until-end"},
    "view": {"--save": "--output"},
    "sitl": {"--report": "--output"},
    "demo": {"--report": "--output"},
    "host": {"--logs": "--output"},
    "calibrate camera": {"--preview": "--judged"},
    "calibrate extrinsics": {"--preview": "--output"},
    "bench estimator": {"--duration": "--flight-ms"},
    "experiment faults": {"--seconds": "--duration"},
    "experiment scenarios": {"--seconds": "--duration"},
}
"""Old spellings of options by command: each had another meaning, or another name, elsewhere."""
