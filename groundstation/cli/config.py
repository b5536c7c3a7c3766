"""`groundstation config`: check, show, draw, describe or start a field file."""

import json
from pathlib import Path

import click

from groundstation.cli.exits import ExitCode
from groundstation.errors import SettingsError

_OPTION = click.option("--set", "options", multiple=True, metavar="A.B=C", help="Override one setting; repeatable.")


@click.group(epilog="\b\nExamples:\n  groundstation config check lab.yaml\n  groundstation config init my_lab")
def config() -> None:
    """Check, show, draw, describe or create a field file."""


@config.command(
    epilog="\b\nExamples:\n  groundstation config check lab.yaml\n"
    "  groundstation config check lab.yaml --set drones.drone_2.enabled=false --scenario realistic"
)
@click.argument("field")
@_OPTION
@click.option("--scenario", metavar="S", help="Check a scenario (a name or a path) as well.")
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help='Print JSON: {"ok", "problems", "findings": [{file, line, path, level, text}]}.',
)
def check(field: str, options: tuple[str, ...], scenario: str | None, as_json: bool) -> int:
    """Name every mistake in a field file (a path, or `lab`), each with its line, and warn of settings that are legal
    but unwise.

    Exit code 0 if there is no mistake, 2 otherwise; a WARNING is no mistake.
    """
    from groundstation.settings.wording import told

    problems: list[str] = []
    warnings: list[str] = []
    try:
        warnings = _check(field, options, scenario)
    except SettingsError as error:
        if not as_json:
            raise
        problems = error.problems
    if as_json:
        findings = [told(line, "ERROR")._asdict() for line in problems]
        findings += [told(line, "WARNING")._asdict() for line in warnings]
        click.echo(json.dumps({"ok": not problems, "problems": problems, "findings": findings}))
    else:
        for line in warnings:
            click.echo(f"WARNING: {line}")
    return ExitCode.SETTINGS if problems else ExitCode.OK


def _targets(names: tuple[str, ...]) -> str:
    return f"{'target' if len(names) == 1 else 'targets'} {', '.join(names)}"


def _check(name: str, options: tuple[str, ...], scenario: str | None) -> list[str]:
    """Return the warnings about a field without mistakes; raises SettingsError with all mistakes."""
    from groundstation.settings.files import find_field, find_scenario
    from groundstation.settings.load import cautions_of, load_field
    from groundstation.settings.scenario import Room, load_scenario
    from groundstation.settings.scenario_fit import made_for, misfits

    path = find_field(name)
    problems: list[str] = []
    cautions: list[str] = []
    warnings: list[str] = []
    field = None
    try:
        field = load_field(path, options)
        cautions = cautions_of(path, options)
        team = f"{len(field.drones)} drone(s), {len(field.cameras)} fixed camera(s), {_targets(tuple(field.tracked))}"
    except SettingsError as error:
        problems += error.problems
    if scenario is not None:
        try:
            plain = load_scenario(find_scenario(scenario, path), room=Room(field) if field else None)
            warnings += [f"{scenario}: {sentence}" for sentence in made_for(path, plain)]
            if field is not None:
                problems += [f"{scenario}: {sentence}" for sentence in misfits(field, plain)]
        except SettingsError as error:
            problems += error.problems
    if problems:
        raise SettingsError(problems)
    click.echo(f"{path}: good ({team})", err=True)
    return cautions + warnings


@config.command(
    epilog="\b\nExamples:\n  groundstation config show lab.yaml\n"
    "  groundstation config show lab.yaml --resolved > flown.yaml\n"
    "  groundstation config show lab.yaml --resolved --json | jq .drones"
)
@click.argument("field")
@_OPTION
@click.option("--resolved", is_flag=True, help="Print every setting as the processes will see it.")
@click.option("--json", "as_json", is_flag=True, help="Print the resolved settings as JSON.")
def show(field: str, options: tuple[str, ...], resolved: bool, as_json: bool) -> None:
    """Show a field file: a page to read, or (--resolved) every setting with its three levels merged."""
    from groundstation.settings.files import find_field
    from groundstation.settings.load import load_field
    from groundstation.settings.resolved import summary_of, yaml_of

    settings = load_field(find_field(field), options)
    if as_json:
        click.echo(settings.model_dump_json(indent=2))
    else:
        click.echo(yaml_of(settings) if resolved else summary_of(settings))


@config.command(epilog="\b\nExample:\n  groundstation config scenario unkind-autopilots > unkind.json")
@click.argument("scenario")
def scenario(scenario: str) -> None:
    """Check a scenario (a name or a path) and print it as JSON, the simulator's input."""
    from groundstation.settings.files import find_scenario
    from groundstation.settings.scenario import load_scenario

    click.echo(json.dumps(load_scenario(find_scenario(scenario, Path())), indent=2))


@config.command(
    epilog="\b\nExample:\n  groundstation config schema > field.schema.json\n"
    "  (then, as first line of lab.yaml: # yaml-language-server: $schema=field.schema.json)"
)
def schema() -> None:
    """Print the JSON Schema of a field file, for completion and checks in an editor."""
    from groundstation.settings.json_schema import field_file_schema

    click.echo(json.dumps(field_file_schema(), indent=2))


@config.command(epilog="\b\nExample:\n  groundstation config draw lab.yaml --scenario realistic --output room.png")
@click.argument("field")
@_OPTION
@click.option("--scenario", metavar="S", help="Draw the target's path of a scenario (a name or a path) as well.")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    default=Path("room.png"),
    show_default=True,
    help="PNG, SVG or PDF.",
)
def draw(field: str, options: tuple[str, ...], scenario: str | None, output: Path) -> None:
    """Draw the room to scale: fence, pads, level heights, and where the fixed cameras see drones at each of them."""
    from groundstation.recording.outputs import replaced_file
    from groundstation.settings import drawing
    from groundstation.settings.files import find_field, find_scenario
    from groundstation.settings.load import load_field
    from groundstation.settings.scenario import load_scenario

    if output.suffix not in (".png", ".svg", ".pdf"):
        raise click.UsageError(f"--output {output}: must end in .png, .svg or .pdf")
    path = find_field(field)
    settings = load_field(path, options)
    plain = load_scenario(find_scenario(scenario, path)) if scenario else {}
    with replaced_file(output) as partial:
        drawing.draw(settings, partial, drawing.paths_of(plain, settings.tracked))
    click.echo(f"wrote {output}")


@config.command(
    epilog="\b\nExamples:\n  groundstation config init my_lab && groundstation sitl my_lab/lab.yaml\n"
    "  groundstation config init my_lab --like mixed-team"
)
@click.argument("directory", type=click.Path(path_type=Path, file_okay=False))
@click.option(
    "--like",
    type=click.Choice(["lab", "mixed-team", "mocap-lab", "mocap-truth", "two-targets", "uwb-lab"]),
    default="lab",
    show_default=True,
    help="lab: two AR.Drones, one ceiling camera; mixed-team: AR.Drone, PX4 and ArduPilot vehicle, two cameras; "
    "mocap-lab, mocap-truth: motion capture as the sensor, or as the judge; two-targets; uwb-lab: ranging.",
)
def init(directory: Path, like: str) -> None:
    """Write a commented field file to start from, its calibrations and the shipped scenarios into DIRECTORY."""
    from groundstation.recording.outputs import errors_named
    from groundstation.settings.files import SHIPPED
    from groundstation.settings.shipped_copies import copy, refuse_existing, shipped

    sources = [SHIPPED / f"{like}.yaml", *shipped()]
    targets = [directory / source.relative_to(SHIPPED) for source in sources]
    refuse_existing(targets)
    for source, target in zip(sources, targets, strict=True):
        with errors_named(target):
            copy(source, target)
        click.echo(f"wrote {target}")
    click.echo(
        f"next: groundstation sitl {targets[0]}; for your own lab: room, cameras, addresses and pads in it, then"
    )
    click.echo(f"groundstation config check {targets[0]}")
