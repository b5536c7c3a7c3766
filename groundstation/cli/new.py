"""`groundstation new`: a field file from a few questions."""

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import click

from groundstation.errors import OperatorMistake

if TYPE_CHECKING:
    from groundstation.settings.new_field import NewDrone


@click.command(epilog="\b\nExamples:\n  groundstation new my_lab\n  groundstation sitl my_lab/my_lab.yaml")
@click.argument("directory", type=click.Path(path_type=Path, file_okay=False))
def new(directory: Path) -> None:
    """Ask for room, camera and drones, draw the room, and write a commented field file into DIRECTORY."""
    from groundstation.settings.new_field import NewRoom, check_room, field_text
    from groundstation.settings.room_text import room_text

    site = directory.resolve().name
    path = directory / f"{site}.yaml"
    if path.exists():
        raise OperatorMistake(f"{path}: is there already; nothing was written; name another folder")
    click.echo("The floor's middle is the origin, x along the long side. Enter takes what stands in brackets.")
    length = click.prompt("Length of the room [m]", default=8.0, type=click.FloatRange(3, 60))
    width = click.prompt("Width [m]", default=6.0, type=click.FloatRange(3, length))
    height = click.prompt("Height [m]", default=4.5, type=click.FloatRange(3, 20))
    source = click.prompt("Pictures of the ceiling camera", default="http://192.168.1.50:8080/video.mjpg")
    room = NewRoom(length, width, height, source)
    check_room(room)
    drones = _ask_drones()
    text = field_text(site, room, drones)
    click.echo(room_text(room, len(drones)))
    click.echo("Digits are pads, dots what the ceiling camera sees 1 m above the floor.")
    if not click.confirm(f"Write {path}?", default=True):
        raise OperatorMistake("nothing was written")
    _write(path, text)
    click.echo(f"wrote {path}\nnext: groundstation config check {path}, then groundstation sitl {path}")


def _ask_drones() -> "list[NewDrone]":
    from groundstation.settings.new_field import KINDS, NewDrone

    drones: list[NewDrone] = []
    for number in range(1, 1 + click.prompt("How many drones", default=2, type=click.IntRange(1, 9))):
        before = drones[-1].kind if drones else KINDS[0]
        kind = click.prompt(f"Kind of drone_{number}", default=before, type=click.Choice(KINDS))
        address = click.prompt("  its address", default=f"192.168.1.{10 + number}")
        own = f"ardrone://{address}" if kind == "ardrone" else f"http://{address}:8080/video.mjpg"
        drones.append(NewDrone(kind, address, click.prompt("  pictures of its camera", default=own)))
    return drones


def _write(path: Path, text: str) -> None:
    from groundstation.settings.files import SHIPPED

    for source in (*sorted(SHIPPED.glob("cameras/*.yaml")), *sorted(SHIPPED.glob("scenarios/*.yaml"))):
        target = path.parent / source.relative_to(SHIPPED)
        target.parent.mkdir(parents=True, exist_ok=True)
        if not target.exists():
            shutil.copyfile(source, target)
    path.write_text(text, encoding="utf-8")
