"""`groundstation mavlink`: lists vehicles on a link, and checks parameters for indoor flight."""

from pathlib import Path
from typing import Any

import click

from groundstation.appearance.plain_text import one_line
from groundstation.cli.exits import ExitCode
from groundstation.cli.numbers import FiniteRange
from groundstation.errors import OperatorMistake

_SILENCE = (
    "is it switched on, is this computer in its network, does another program hold the port, "
    "and who calls whom: udpin: waits for the vehicle's call, udpout: calls it"
)

_OLD = (
    "somebody there speaks MAVLink 1 only, which is not understood: set version 2 on the vehicle "
    "(PX4: MAV_PROTO_VER 2; ArduPilot: SERIALn_PROTOCOL 2)"
)


@click.group(
    epilog="\b\nExamples:\n  groundstation mavlink probe udpin:0.0.0.0:14550\n"
    "  groundstation mavlink setup --check lab.yaml drone_2"
)
def mavlink() -> None:
    """Inspect MAVLink vehicles: probe a link, check and set parameters."""


@mavlink.command(
    epilog="\b\nExamples:\n  groundstation mavlink probe udpin:0.0.0.0:14550\n"
    "  groundstation mavlink probe udpout:192.168.1.12:14550 --seconds 5\n"
    "  groundstation mavlink probe serial:/dev/ttyUSB0:921600\n\n"
    "Exit codes: 0 somebody answered, 2 wrong usage, 4 nobody did."
)
@click.argument("link")
@click.option("--seconds", type=FiniteRange(0.5, 60), default=3.0, show_default=True, help="How long to listen [s].")
@click.option("--key-file", default="", help="Signing key, for a signed link.")
@click.option("--mavsdk", "with_mavsdk", is_flag=True, help="Use MAVSDK instead of pymavlink.")
def probe(link: str, seconds: float, key_file: str, with_mavsdk: bool) -> int:
    """List the vehicles that answer on LINK, without changing anything on them.

    LINK: udpin:ADDRESS:PORT waits for vehicles that call this computer, udpout:ADDRESS:PORT calls one,
    serial:DEVICE:BAUD is a radio. ADDRESS%ADAPTER uses that network adapter only.
    """
    from drivers.mavlink.links.opening import open_link
    from drivers.mavlink.probe import probe as look

    opened = open_link(_link_settings(link, key_file, "mavsdk" if with_mavsdk else "pymavlink"))
    try:
        found = look(opened, seconds)
    finally:
        opened.close()
    for system, vehicle in sorted(found.items()):
        facts = [vehicle.flavour, vehicle.version, vehicle.mode, "ARMED" if vehicle.armed else "disarmed"]
        facts += [f"battery {vehicle.battery}" if vehicle.battery else "", "has a position" if vehicle.located else ""]
        click.echo(f"system {system:3d}: {', '.join(filter(None, facts))}; {vehicle.frames / seconds:.0f} messages/s")
        if vehicle.serial_number:
            click.echo(f"  serial_number {vehicle.serial_number}")
        if vehicle.video:
            click.echo(f"  video {vehicle.video}")
        for text in vehicle.texts:
            click.echo(f"  says: {one_line(text)}")
    for reason, count in sorted(opened.rejected.items()):
        click.echo(f"refused: {count} x {reason.replace('_', ' ')}")
    if not found:
        remedy = _OLD if opened.rejected["mavlink_1"] else _SILENCE
        click.echo(f"nobody answers on {link} within {seconds:g} s; {remedy}", err=True)
        return ExitCode.FAULT
    return ExitCode.OK


@mavlink.command(
    epilog="\b\nExamples:\n  groundstation mavlink setup --check lab.yaml drone_2\n"
    "  groundstation mavlink setup --apply lab.yaml drone_2\n\n"
    "Exit codes: 0 all as needed, 1 differences are left, 2 wrong settings, 4 it does not answer, or is armed."
)
@click.argument("field", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.argument("drone")
@click.option("--check/--apply", default=True, help="Only print the differences, or write them as well.")
@click.option("--address", help="ADDRESS:PORT, if not the field file's.")
def setup(field: Path, drone: str, check: bool, address: str | None) -> int:
    """Compare the parameters of DRONE in FIELD with what indoor flight needs; with --apply, write what differs."""
    from drivers.mavlink.links.opening import open_link
    from drivers.mavlink.setup import ParameterSetup
    from drivers.mavlink.wire.names import Flavour

    settings, vehicle = _vehicle(field, drone)
    link = settings.link
    if address is not None:
        link = _link_settings(f"udpout:{address}", link.key_file, link.kind)
    opened = open_link(link)
    left = changed = 0
    try:
        work = ParameterSetup(opened, vehicle.system_id, Flavour[vehicle.flavour.upper()], link.system_id,
                              vehicle.parameters, link)  # fmt: skip
        work.connect()
        for found in work.differences():
            taken = not check and work.apply(found.wanted)
            left += not taken
            changed += taken
            click.echo(found.text + ("" if check else ": set" if taken else ": NOT TAKEN"))
    finally:
        opened.close()
    if not left:
        click.echo(f"{drone}: all parameters as needed" + ("; restart it before the first flight" if changed else ""))
    return ExitCode.FAILED if left else ExitCode.OK


def _link_settings(target: str, key_file: str, kind: str) -> Any:
    from pydantic import ValidationError

    from drivers.mavlink.settings import LinkSettings

    try:
        return LinkSettings.model_validate({"kind": kind, "target": target, "key_file": key_file})
    except ValidationError as error:
        told = [one["msg"].removeprefix("Value error, ") for one in error.errors()]
        raise OperatorMistake(f"{target}: {'; '.join(told)}") from None


def _vehicle(path: Path, name: str) -> tuple[Any, Any]:
    from drivers.mavlink.settings import MavlinkDriverSettings
    from groundstation.settings.load import load_field
    from groundstation.settings.sections import driver_sections

    field = load_field(path)
    for section in driver_sections(field):
        if section.kind == "mavlink":
            settings = MavlinkDriverSettings.model_validate_json(section.section)
            for vehicle in settings.vehicles:
                if vehicle.name == name:
                    return settings, vehicle
    known = [n for n, drone in field.drones.items() if drone.kind == "mavlink"]
    raise OperatorMistake(f"{name} is no MAVLink vehicle of {path}; there are: {', '.join(known) or 'none'}")
