"""`groundstation calibrate team`: all mountings, delays, prints, lenses and odometry figures, from one flight."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from groundstation.cli.exits import ExitCode
from groundstation.errors import OperatorMistake

if TYPE_CHECKING:
    from groundstation.calibration.team import Found, Measured, TeamCalibration
    from groundstation.settings.schema import Field

_WORDS = {
    "print": "marker",
    "focal": "focal length",
    "pan": "pan to the left",
    "tilt": "tilt down",
    "delay": "delay of its pictures",
    "scale": "velocity scale",
    "velocity_delay": "delay of its velocity",
    "height_delay": "delay of its height",
    "own_delay": "delay of all its telemetry",
    "aside": "place",
    "tilted": "tilt",
    "yaw": "turn about the vertical",
    "z": "height",
}


@click.command(
    epilog="\b\nExamples:\n  groundstation calibrate team runs/20261120T101500Z-lab\n"
    "  groundstation calibrate team RUN --field my_lab/lab.yaml -o my_lab/lab-new.yaml\n\n"
    "Fly first (`groundstation fly` or `sitl`): the drones stand on their pads in sight of the fixed camera for 3 s, "
    "take off, and track the target for a minute. Only what contradicts its survey is proposed.\n\n"
    "Exit codes: 0 done, 2 wrong usage, or no recording that can be used."
)
@click.argument("recording", nargs=-1, required=True, type=click.Path(exists=True, path_type=Path))
@click.option(
    "--field",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="The field file to change.  [default: the field that was flown]",
)
@click.option(
    "-o", "--output", type=click.Path(dir_okay=False, path_type=Path), help="Write the field with the changes."
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def team(recording: tuple[Path, ...], field: Path | None, output: Path | None, as_json: bool) -> int:
    """Measure mountings, delays, markers, lenses and odometry of a team in RECORDING, and print a patch of the field.

    One least-squares fit over all sightings, odometry and inertial readings. The same recording gives the same figures.
    """
    from groundstation.cli.flown_field import differing
    from groundstation.cli.recorded_flight import recorded_flight
    from groundstation.settings.load import load_field
    from groundstation.settings.resolved import resolved_field

    # A field that cannot be read is reported before a minute of computing.
    told = None if field is None else load_field(field)
    name, flown_with, flown = recorded_flight(recording)
    if told is not None and (note := differing(str(field), told, flown_with)):
        click.echo(f"note: errors are told against the field that was flown; {note}", err=True)
    from groundstation.calibration.team import calibrate_team

    found = calibrate_team(flown, resolved_field(flown_with))
    click.echo(_json(found) if as_json else f"{name}: {flown.duration_s:.0f} s, {found.sightings} sightings")
    if not as_json:
        click.echo("\n".join(_lines(found, flown_with.model_dump(mode="json"))))
    if output is not None:
        _write(output, field, flown_with, found)
    return ExitCode.OK


def _write(output: Path, field: Path | None, flown_with: "Field", found: "TeamCalibration") -> None:
    from groundstation.settings.patched import write_patched
    from groundstation.settings.resolved import yaml_of

    if not found.settings:
        raise OperatorMistake(f"{output}: is not written, as there is nothing to change")
    text = field.read_text(encoding="utf-8-sig") if field is not None else yaml_of(flown_with)
    write_patched(output, text, found.settings, flown_with.model_dump(mode="json"))
    click.echo(f"wrote {output}", err=True)


def _json(found: "TeamCalibration") -> str:
    values = {
        "figures": [asdict(one) for one in found.figures],
        "found": [
            {"who": one.who, "what": one.what, "error": one.error, "std": one.std, "unit": one.unit}
            | {"rivals": [[other.who, other.what] for other in one.rivals]}
            for one in found.found
        ],
        "settings": {".".join(path): value for path, value in found.settings.items()},
        "gain": None if found.gain is None else asdict(found.gain),
    }
    return json.dumps(values, indent=2)


def _lines(found: "TeamCalibration", flown_with: dict[str, Any]) -> list[str]:
    lines = [f"{'figure':26} {'error against the field':>26}   if all others were in doubt"]
    lines += [_row(one) for one in found.figures]
    if not found.found:
        return [*lines, "no setting is contradicted: nothing to change"]
    lines += ["", *(_told(one) for one in found.found)]
    if found.gain is not None:
        lines.append(
            f"the tracker's distance from the targets' likeliest paths: {found.gain.before_m:.3f} m as flown, "
            f"{found.gain.after_m:.3f} m with the changes"
        )
    if not found.settings:
        return [*lines, "no setting of the field mends that: check the clock of the drone and the link to it"]
    from groundstation.calibration.team_settings import entry_at
    from groundstation.settings.patched import fragment

    changes = [f"  {'.'.join(path)}: {entry_at(flown_with, path)} -> {value}" for path, value in found.settings.items()]
    return [*lines, "change in the field file:", *changes, "in its form:", fragment(found.settings).rstrip()]


def _row(one: "Measured") -> str:
    error = f"{one.error:+.2f} +- {one.std:.2f} {one.unit}"
    other = "" if one.beside is None else " ".join(one.beside)
    if one.shown:
        shown = f"+- {one.doubtful_std:.2f} {one.unit}" + (f", shared with {other}" if other else "")
    elif one.corrected:
        shown = f"+- {one.doubtful_std:.2f} {one.unit}: corrected below, because the others are surveyed"
    else:
        shown = f"not told apart from {other}" if other else "this flight tells too little of it"
    return f"{one.who + ' ' + one.part:26} {error:>26}   {shown}"


def _told(one: "Found") -> str:
    who: Any = one.who or "every drone"
    what = _WORDS.get(one.what, one.what)
    if one.what == "print" and not one.who:
        who, what = "all markers", "scaled by the printer"
    text = f"{who}: {what} is off by {one.error:+.2f} +- {one.std:.2f} {one.unit}"
    if one.rivals:
        others = ", ".join(f"{other.who or 'all'} {_WORDS.get(other.what, other.what)}" for other in one.rivals[:3])
        text += f" (explained nearly as well by: {others})"
    return text
