"""`groundstation console`: the web page of a present run, from any terminal."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from groundstation.cli.monitor import cast_of, choose
from groundstation.errors import OperatorMistake
from groundstation.process.standard_streams import with_sequences

if TYPE_CHECKING:
    from groundstation.console.devices import Devices
    from groundstation.field.resolved import ResolvedField
    from groundstation.supervisor.runtime_file import RuntimeRecord


@click.command(
    epilog="\b\nExamples:\n  groundstation console\n  groundstation console --port 9000 --run lab-4711\n"
    "  groundstation console --invite stop\n  groundstation console --uninvite"
)
@click.option("--run", "name", metavar="NAME", help="The run to show, if there are several.")
@click.option(
    "--invite",
    metavar="ROLE",
    type=click.Choice(("watch", "stop", "command")),
    help="Let one tablet or phone in as watch, stop or command, by a code that works once; needs console.listen in the "
    "field.",
)
@click.option(
    "--uninvite",
    is_flag=True,
    help="Withdraw the rights of all tablets and phones, after one was lost: their open pages end.",
)
@click.option("--port", type=click.IntRange(1024, 65535), help="Port to serve on (default: the field's console.port).")
def console(name: str | None, invite: str | None, uninvite: bool, port: int | None) -> None:
    """Serve the operator's page for a running ground station, on loopback. Leaving it stops nothing.

    With --invite: print an address (also as a QR code) at which one device may open the run's own page. With --uninvite
    all devices must be invited anew.
    """
    import asyncio

    from groundstation.bus.roles import Role
    from groundstation.bus.zenoh_bus import speak_on_one_thread
    from groundstation.console.room import bare_scene, scene_from_field
    from groundstation.console.section import enough_hz, run_id
    from groundstation.console.server import ConsoleServer, claim_port
    from groundstation.field.behaviour import ConsoleValues
    from groundstation.supervisor.joining import join

    record = choose(name)
    if uninvite:
        _uninvite(record)
    if invite is not None:
        _invite(record, invite)
    if uninvite or invite is not None:
        return
    cast, field = cast_of(record), _field_of(record)
    truth = record.has_truth
    scene = scene_from_field(field, truth) if field else bare_scene(record.site, record.drones, truth)
    listener = claim_port(port or (field.console if field else ConsoleValues()).port)
    speak_on_one_thread()
    bus = join(record, "console", Role.CONSOLE, at_most_hz=enough_hz(record.site, cast.drones, cast.targets))
    try:
        server = ConsoleServer(bus, cast, scene, field, listener, run_id(record.run_dir))
        click.echo(f"console of {record.name} at {server.url} (Ctrl-C leaves it; the flight goes on)")
        asyncio.run(server.serve(lambda turns, _late: not server.ended and (turns % 20 != 0 or record.alive)))
        click.echo("the run has ended")
    except KeyboardInterrupt:
        pass
    finally:
        bus.close()


def _devices_of(record: "RuntimeRecord") -> "Devices":
    from groundstation.console.devices import Devices
    from groundstation.console.section import devices_of

    devices = Devices(devices_of(record.identities))
    if not devices.url:
        raise OperatorMistake(f"the console of {record.name} is on loopback only: set console.listen in the field")
    return devices


def _uninvite(record: "RuntimeRecord") -> None:
    count = _devices_of(record).uninvite()
    click.echo(f"withdrawn: {count} (devices and open invitations); invite those that shall stay anew")


def _invite(record: "RuntimeRecord", role: str) -> None:
    from groundstation.console.devices import DeviceRole
    from groundstation.console.qr import qr_text

    devices = _devices_of(record)
    address = devices.invite(DeviceRole(role))
    click.echo(qr_text(address), with_sequences(sys.stdout))
    click.echo(f"{address}\none device may {role}; the code works once, within 10 minutes")
    click.echo("the browser warns of a certificate that nobody signed; it is the right one if its SHA-256 is")
    click.echo(devices.fingerprint)


def _field_of(record: "RuntimeRecord") -> "ResolvedField | None":
    """Return the resolved field from the present recording, or None."""
    from groundstation.field.resolved import field_from_json
    from groundstation.recording.reader import attached_field

    try:
        return field_from_json(attached_field(Path(record.run_dir)))
    except ValueError:
        return None
