"""`groundstation doctor`: checks what this machine needs for a flight."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from groundstation.cli.exits import ExitCode

if TYPE_CHECKING:
    from groundstation.doctor.finding import Finding
    from groundstation.settings.schema import Field


@click.command(epilog="\b\nExamples:\n  groundstation doctor\n  groundstation doctor my_lab/lab.yaml --json")
@click.argument("field", default="lab")
@click.option("--json", "as_json", is_flag=True, help="Print JSON: [{level, subject, found, remedy}].")
def doctor(field: str, as_json: bool) -> int:
    """Check what this machine lacks for flying a field file, and name the remedy; nothing is started.

    Exit code 1 if something must be mended before a flight.
    """
    from groundstation.doctor.finding import Level

    findings = _examine(field)
    if as_json:
        click.echo(json.dumps([finding._asdict() for finding in findings], indent=2))
    else:
        width = max(len(finding.subject) for finding in findings)
        for finding in findings:
            click.echo(f"{finding.level:6}  {finding.subject:{width}}  {finding.found}")
            if finding.remedy:
                click.echo(f"{'':6}  {'':{width}}  -> {finding.remedy}")
    return ExitCode.FAILED if any(finding.level is Level.MUST for finding in findings) else ExitCode.OK


def _awaited(field: "Field") -> dict[str, tuple[str, int]]:
    """Return the UDP ports at which drivers of this host wait for their vehicles, by the drivers' names."""
    from groundstation.settings.sections import driver_sections

    links = {one.name: json.loads(one.section).get("link") for one in driver_sections(field) if not one.host}
    targets = {name: link.get("target", "").split(":") for name, link in links.items() if isinstance(link, dict)}
    calls = {name: parts for name, parts in targets.items() if len(parts) == 3}
    return {n: (host.partition("%")[0], int(at)) for n, (way, host, at) in calls.items() if way == "udpin"}


def _examine(name: str) -> "list[Finding]":
    from groundstation.doctor import load, network, processor, storage
    from groundstation.doctor.plug_ins import plug_in_findings
    from groundstation.settings.files import find_field
    from groundstation.settings.load import load_field

    field = load_field(find_field(name))
    folder = Path(field.recording.directory)
    found = [
        processor.cores(),
        load.load(),
        processor.real_time_right(),
        processor.clock_source(),
        processor.governor(),
        storage.memory(),
        storage.open_files(),
        storage.room(folder),
        storage.speed(folder),
        network.port(field.console.port, "console"),
        network.port(field.bus.port, "router"),
        *(network.datagram_port(place, name) for name, place in _awaited(field).items()),
        *network.power_saving(),
        *plug_in_findings(),
    ]
    return [finding for finding in found if finding is not None]
