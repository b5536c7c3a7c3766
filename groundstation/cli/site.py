"""`groundstation site`: admits other hosts that may stop and order."""

from pathlib import Path

import click


@click.group(
    epilog="\b\nExamples:\n  groundstation site init lab\n  groundstation site admit lab laptop 192.168.1.10\n"
    "  groundstation site join laptop.admission   (on the laptop)"
)
def site() -> None:
    """Admit other hosts to the runs of a site, whose drones they may then command."""


@site.command()
@click.argument("name", metavar="SITE")
def init(name: str) -> None:
    """Create the authority of SITE (the field's `site`), once, on the host of its ground station."""
    from groundstation.supervisor.site import found

    click.echo(f"{found(name)}: whoever can read this can make a drone move")


@site.command()
@click.argument("name", metavar="SITE")
@click.argument("host", metavar="HOST")
@click.argument("address", metavar="ADDRESS")
@click.option(
    "--port", type=click.IntRange(1024, 65535), default=4717, show_default=True, help="Port that the run serves on."
)
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Where to (default: HOST.admission).")
def admit(name: str, host: str, address: str, port: int, output: Path | None) -> None:
    """Admit HOST to SITE: write the file with which it joins. ADDRESS is the ground station's, as in `bus.listen`.

    HOST may then stop drones, and ask the run's operator to start. Carry the file over in secret, then delete it.
    """
    from groundstation.supervisor.site import admit as write_admission

    file = output or Path(f"{host}.admission")
    write_admission(name, host, f"tls/{address}:{port}", file)
    click.echo(f"{file}: carry it to {host}, and there: groundstation site join {file.name}")


@site.command()
@click.argument("name", metavar="SITE")
@click.argument("host", metavar="HOST")
def expel(name: str, host: str) -> None:
    """Exclude HOST, from the next run on."""
    from groundstation.supervisor.site import expel as strike

    strike(name, host)
    click.echo(f"{host} is no member of {name} any more; a run that goes on still lets it in")


@site.command()
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
def join(file: Path) -> None:
    """Make this host a member of the site that admitted it; `land` and the other commands then reach its runs."""
    from groundstation.supervisor.site import join as take_part

    admission = take_part(file)
    click.echo(f"this host is {admission.host} of {admission.site}: groundstation hold, land, ... reach its run")
    click.echo(f"remove {file}: it is a key")
