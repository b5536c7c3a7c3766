"""`groundstation vehicle`: which kinds of vehicles there are, and whether one keeps the contract of a driver."""

import subprocess
import sys

import click


@click.group(epilog="\b\nExamples:\n  groundstation vehicle list\n  groundstation vehicle check tello")
def vehicle() -> None:
    """Kinds of vehicles: list them, judge one."""


@vehicle.command("list", epilog="\b\nExamples:\n  groundstation vehicle list\n\nExit codes: 0.")
def list_() -> None:
    """List the kinds that can be flown, and those that are installed and cannot be loaded, with the reason."""
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
    "--with", "options", multiple=True, metavar="SECTION.KEY=VALUE", help="A key of its own section; repeatable."
)
@click.option("--only", default="", metavar="WORDS", help="Only these checks or flights, by commas.")
@click.option(
    "--damaged", type=click.IntRange(1), default=2000, show_default=True, help="How many damaged datagrams are sent."
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def check(kind: str, options: tuple[str, ...], only: str, damaged: int, as_json: bool) -> int:
    """Judge KIND: its driver flies its emulator, in real time on loopback addresses, for six minutes or so."""
    # The simulator is never imported by what flies.
    command = [sys.executable, "-m", "sim_bridge.conformance", kind, "--only", only, "--damaged", str(damaged)]
    for option in options:
        command += ["--with", option]
    return subprocess.run([*command, *(["--json"] if as_json else [])], check=False).returncode
