"""`groundstation ardrone`: identifies an AR.Drone and sets its network and owner, without flying it."""

import ipaddress
import json
from typing import TYPE_CHECKING, Any

import click

from groundstation.cli.exits import ExitCode
from groundstation.errors import DriverError

if TYPE_CHECKING:
    from collections.abc import Callable

    from drivers.ardrone.probe import ProbeReport


@click.group(
    epilog="\b\nExamples:\n  groundstation ardrone probe 192.168.1.1\n  groundstation ardrone join 192.168.1.1 LAB"
)
def ardrone() -> None:
    """Inspect and set AR.Drones."""


def _address(_context: click.Context, _parameter: click.Parameter, value: str) -> str:
    address, percent, interface = value.partition("%")
    try:
        if bool(percent) is not bool(interface):
            raise ValueError(value)
        return f"{ipaddress.IPv4Address(address)}{percent}{interface}"
    except ValueError:
        like = "such as 192.168.1.1, or 192.168.1.1%wlan1 behind that network adapter"
        raise click.BadParameter(f"{value!r} is no IPv4 address, {like}.") from None


@ardrone.command(
    epilog="\b\nExamples:\n  groundstation ardrone probe 192.168.1.1\n"
    "  groundstation ardrone probe 192.168.1.1%wlan1    (behind that network adapter)\n"
    "  groundstation ardrone probe 192.168.1.11 --json\n\n"
    "Exit codes: 0 it answered, 2 no address, 4 nobody answers there."
)
@click.argument("address", callback=_address)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def probe(address: str, as_json: bool) -> int:
    """Print model, firmware, battery, navdata, link and configuration of the drone at ADDRESS.

    Safe at any time: it sends nothing that starts, moves or ends a flight, and no command at all to a drone in the air.
    """
    from drivers.ardrone.probe import probe as look

    try:
        report = look(address)
    except DriverError as error:
        hints = "is it switched on, is this computer in its network (ping it), is it paired with somebody else?"
        click.echo(f"{error}; {hints}", err=True)
        return ExitCode.FAULT
    click.echo(json.dumps(_facts(report), indent=2) if as_json else _text(report))
    return ExitCode.OK


@ardrone.command(
    epilog="\b\nExamples:\n  groundstation ardrone join 192.168.1.1 LAB\n"
    "  groundstation ardrone join 192.168.1.11 --access-point    (what it was when new)\n\n"
    "Exit codes: 0 set, 1 it did not take a setting, 2 wrong arguments, 4 it does not answer, or flies."
)
@click.argument("address", callback=_address)
@click.argument("network", default="")
@click.option("--access-point", is_flag=True, help="Make it an access point of its own again.")
def join(address: str, network: str, access_point: bool) -> int:
    """Make the drone at ADDRESS join the open network NETWORK, with a free address, each time it starts."""
    from drivers.ardrone.network_setup import membership

    if access_point == bool(network):
        raise click.UsageError("Name the network, or give --access-point.")
    code = _write(address, lambda: membership(network))
    if code == ExitCode.OK:
        where = (
            "192.168.1.1" if access_point else "the access point's list of clients shows its address; probe it there"
        )
        click.echo(f"switch it off and on again; then: {where}")
    return code


@ardrone.command(
    epilog="\b\nExamples:\n  groundstation ardrone setup 192.168.1.11 --pair\n"
    "  groundstation ardrone setup 192.168.1.11 --unpair\n\n"
    "Exit codes: 0 set, 1 it did not take a setting, 2 wrong arguments, 4 it does not answer, or flies."
)
@click.argument("address", callback=_address)
@click.option("--pair", is_flag=True, help="Obey this computer only.")
@click.option("--owner", metavar="MAC", help="Obey the computer with this hardware address only.")
@click.option("--unpair", is_flag=True, help="Obey anybody in its network, as when new.")
def setup(address: str, pair: bool, owner: str | None, unpair: bool) -> int:
    """Set which computer the drone at ADDRESS obeys.

    That prevents mistakes, not attacks: hardware addresses can be forged.
    """
    from drivers.ardrone.network_setup import UNPAIRED, own_hardware_address, pairing

    if pair + unpair + (owner is not None) != 1:
        raise click.UsageError("Give one of --pair, --owner and --unpair.")
    return _write(address, lambda: pairing(UNPAIRED if unpair else owner or own_hardware_address(address)))


@ardrone.command(
    epilog="\b\nExamples:\n  groundstation ardrone trim 192.168.1.11\n\n"
    "Exit codes: 0 told, 2 wrong arguments, 4 it does not answer, or flies."
)
@click.argument("address", callback=_address)
def trim(address: str) -> int:
    """Make the drone at ADDRESS take its present attitude as level, until it is switched off.

    For fields with `ardrone.flat_trim: on_order`: put it on something level, trim it, then start the ground station.
    """
    from drivers.ardrone.network_setup import trim as order

    try:
        order(address)
    except DriverError as error:
        click.echo(str(error), err=True)
        return ExitCode.FAULT
    click.echo(f"{address} was told that it stands level; nothing acknowledges that")
    return ExitCode.OK


def _write(address: str, settings: "Callable[[], dict[str, str]]") -> int:
    from drivers.ardrone.network_setup import change

    try:
        wanted = settings()
        found = change(address, wanted)
    except DriverError as error:
        click.echo(str(error), err=True)
        return ExitCode.FAULT
    refused = False
    for key, (before, after) in found.items():
        taken = after == wanted[key]
        refused = refused or not taken
        said = "as it was" if taken and before == after else f"was {before or 'empty'}" if taken else "NOT TAKEN"
        click.echo(f"{key} {wanted[key]}: {said}")
    return ExitCode.FAILED if refused else ExitCode.OK


def _facts(report: "ProbeReport") -> dict[str, Any]:
    identity = report.identity
    return {
        "address": report.address,
        "model": identity.model.value,
        "firmware": identity.firmware or None,
        "serial": identity.serial or None,
        "battery": report.battery,
        "phase": report.phase or None,
        "state": f"{report.state:08x}",
        "state_words": list(report.words),
        "navdata": [
            {"mode": s.mode, "rate_hz": round(s.rate_hz, 1), "link_quality": s.link_quality} for s in report.streams
        ],
        "config": {key: {"value": value, "category": kind or None} for key, (value, kind) in report.config.items()},
        "hints": report.hints,
    }


def _text(report: "ProbeReport") -> str:
    battery = "unknown" if report.battery is None else f"{report.battery:.0%}"
    lines = [
        f"{report.address}: {report.identity.text}",
        f"battery    {battery}",
        f"phase      {report.phase or 'unknown'}",
        f"state      {report.state:08x}: {', '.join(report.words)}",
    ]
    for stream in report.streams:
        link = "" if stream.link_quality is None else f", {stream.link_quality:.0%} of the packets arrive"
        lines.append(f"navdata    {stream.mode}: {stream.rate_hz:.1f} Hz{link}")
    if report.config:
        lines += ["configuration (key, value, set it is kept in)"]
        lines += [f"  {key:38s} {value or '-':28s} {kind or '?'}" for key, (value, kind) in report.config.items()]
    return "\n".join(lines + [f"hint: {hint}" for hint in report.hints])
