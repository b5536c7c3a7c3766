"""`groundstation vehicle`: lists kinds of vehicles, and checks whether one keeps the driver's contract."""

import subprocess
import sys
from pathlib import Path
from pkgutil import resolve_name

import click

from groundstation.cli.exits import ExitCode
from groundstation.errors import DriverError, OperatorMistake


@click.group(
    epilog="\b\nExamples:\n  groundstation vehicle list\n  groundstation vehicle blink lab.yaml\n"
    "  groundstation vehicle check tello"
)
def vehicle() -> None:
    """Vehicles of a field and their kinds: identify a vehicle, list the kinds, check one."""


@vehicle.command("list", epilog="\b\nExamples:\n  groundstation vehicle list\n\nExit codes: 0.")
def list_() -> None:
    """List the kinds that can be flown, and those that are installed but cannot be loaded, with the reason."""
    from groundstation.vehicles import all_kinds, refused_kinds

    for name, kind in all_kinds().items():
        emulated = "" if kind.emulator else "; has no emulator"
        click.echo(f"{name:12s} {kind.summary}{emulated}")
    for name, reason in refused_kinds().items():
        click.echo(f"{name:12s} cannot be used: {reason}")


@vehicle.command(
    epilog="\b\nExamples:\n  groundstation vehicle check tello\n"
    "  groundstation vehicle check tello --with tello.local_address=127.0.0.9\n"
    "  groundstation vehicle check blimp --only square,silence    (two flights of it)\n\n"
    "Exit codes: 0 all checks that apply pass, 1 some fail, 2 wrong usage."
)
@click.argument("kind")
@click.option(
    "--with",
    "options",
    multiple=True,
    metavar="SECTION.KEY=VALUE",
    help="A setting of the kind's own section; repeatable.",
)
@click.option("--only", default="", metavar="WORDS", help="Only these checks or flights, separated by commas.")
@click.option(
    "--damaged", type=click.IntRange(1), default=2000, show_default=True, help="Number of damaged datagrams to send."
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def check(kind: str, options: tuple[str, ...], only: str, damaged: int, as_json: bool) -> int:
    """Check KIND: its driver flies its emulator in real time on loopback addresses, for about six minutes."""
    # Flight software never imports the simulator.
    command = [sys.executable, "-m", "sim_bridge.conformance", kind, "--only", only, "--damaged", str(damaged)]
    for option in options:
        command += ["--with", option]
    return subprocess.run([*command, *(["--json"] if as_json else [])], check=False).returncode


@vehicle.command(
    epilog="\b\nExamples:\n  groundstation vehicle blink lab.yaml            (one drone after the other)\n"
    "  groundstation vehicle blink lab.yaml drone_2\n\n"
    "Which one answers to which name shows whether addresses and system ids are exchanged. Not while a ground station "
    "runs: it holds their links.\n\n"
    "Exit codes: 0 all were told, 1 one cannot blink, 2 wrong settings, 4 one does not answer, or flies."
)
@click.argument("field", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.argument("drones", nargs=-1)
def blink(field: Path, drones: tuple[str, ...]) -> int:
    """Let each drone of FIELD, or the DRONES named, blink or play a tune where it stands, one after the other."""
    from groundstation.settings.load import load_field
    from groundstation.settings.sections import driver_sections
    from groundstation.vehicles import all_kinds

    loaded = load_field(field)
    if strangers := [name for name in drones if name not in loaded.drones]:
        raise OperatorMistake(f"{field}: no drone {', '.join(strangers)}; there are {', '.join(loaded.drones)}")
    worst = ExitCode.OK
    vehicles = [section for section in driver_sections(loaded) if section.kind in all_kinds()]
    sections = {name: section for section in vehicles for name in section.entities}
    for name in drones or tuple(loaded.drones):
        section = sections[name]
        reference, address = all_kinds()[section.kind].blink, loaded.drones[name].address
        if not reference:
            click.echo(f"{name} ({address}): a {section.kind} cannot blink")
            worst = max(worst, ExitCode.FAILED)
            continue
        click.echo(f"{name} ({address}): look and listen now")
        try:
            click.echo(f"{name} ({address}): {resolve_name(reference)(section.section, name)}")
        except DriverError as error:
            click.echo(f"{name}: {error}", err=True)
            worst = ExitCode.FAULT
    return worst
