"""`groundstation new`: a field file from a few questions, in the terminal or on a page."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import click

from groundstation.errors import OperatorMistake

if TYPE_CHECKING:
    from groundstation.settings.new_field import NewDrone, NewRoom, NewTarget

_Answer = TypeVar("_Answer")


@click.command(
    epilog="\b\nExamples:\n  groundstation new my_lab\n  groundstation new my_lab --page\n"
    "  groundstation sitl my_lab/my_lab.yaml"
)
@click.argument("directory", type=click.Path(path_type=Path, file_okay=False))
@click.option("--page", is_flag=True, help="Ask on a page in the browser, which draws the room to scale.")
def new(directory: Path, page: bool) -> None:
    """Ask for room, camera, drones and target, draw the room, and write a commented field file into DIRECTORY."""
    from groundstation.settings.shipped_copies import refuse_existing

    path = directory.resolve()
    path = path / f"{path.name}.yaml"
    refuse_existing([path])
    (_ask_on_page if page else _ask)(path)
    shown = directory / path.name
    click.echo(f"wrote {shown}\nnext: groundstation config check {shown}, then groundstation sitl {shown}")


def _ask(path: Path) -> None:
    from groundstation.settings.new_field import field_text
    from groundstation.settings.shipped_copies import write_field

    click.echo("The floor's middle is the origin, x along the long side. Enter takes what stands in brackets.")
    room = _ask_room()
    drones = _ask_drones(room)
    text = field_text(path.stem, room, drones, _until_possible(lambda: _ask_target(room)))
    if not click.confirm(f"Write {path}?", default=True):
        raise OperatorMistake("nothing was written")
    write_field(path, text)


def _until_possible(ask: Callable[[], _Answer]) -> _Answer:
    """Ask again what cannot be, with all answers before it kept."""
    while True:
        try:
            return ask()
        except OperatorMistake as mistake:
            click.echo(f"{mistake}. Once more:")


def _ask_room() -> "NewRoom":
    from groundstation.settings.new_field import NewRoom, check_room

    length = click.prompt("Length of the room [m]", default=8.0, type=click.FloatRange(3, 60))
    width = click.prompt("Width [m]", default=6.0, type=click.FloatRange(3, length))
    height = click.prompt("Height [m]", default=4.5, type=click.FloatRange(3, 20))
    source = click.prompt("Pictures of the ceiling camera", default="http://192.168.1.50:8080/video.mjpg")
    room = NewRoom(length, width, height, source)
    check_room(room)
    _draw(room, 0)
    return room


def _draw(room: "NewRoom", drones: int) -> None:
    from groundstation.settings.room_text import room_text

    click.echo(room_text(room, drones))
    pads = "Digits are pads, dots" if drones else "Dots are"
    click.echo(f"{pads} what the ceiling camera sees 1 m above the floor.")


def _ask_count(room: "NewRoom") -> int:
    count: int = click.prompt("How many drones", default=2, type=click.IntRange(1, 9))
    _draw(room, count)
    return count


def _ask_drones(room: "NewRoom") -> "list[NewDrone]":
    from groundstation.settings.new_field import NewDrone, offers

    count = _until_possible(lambda: _ask_count(room))
    known = offers()
    drones: list[NewDrone] = []
    for number in range(1, 1 + count):
        before = drones[-1].kind if drones else next(iter(known))
        kind = click.prompt(f"Kind of drone_{number}", default=before, type=click.Choice(tuple(known)))
        address = click.prompt("  its address", default=f"192.168.1.{10 + number}")
        own = known[kind][1].pictures.replace("{address}", address)
        drones.append(NewDrone(kind, address, click.prompt("  pictures of its camera", default=own)))
    return drones


def _ask_target(room: "NewRoom") -> "NewTarget":
    from groundstation.settings.new_field import BASES, NewTarget, check_target

    base = click.prompt("Target", default=next(iter(BASES)), type=click.Choice(tuple(BASES)))
    board = click.prompt("  height of the marker board on it [m]", default=BASES[base], type=click.FloatRange(0, 3))
    target = NewTarget(base, board)
    check_target(room, target)
    return target


def _ask_on_page(path: Path) -> None:
    import asyncio

    from groundstation.console.new_field.server import FormServer
    from groundstation.console.server import claim_port
    from groundstation.field.behaviour import ConsoleValues

    server = FormServer(path, claim_port(ConsoleValues().port))
    click.echo(f"open {server.url} in a browser (Ctrl-C ends it; nothing is written before its button is pressed)")
    if not asyncio.run(server.serve()):
        raise OperatorMistake("nothing was written")
