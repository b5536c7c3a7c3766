"""`groundstation new`: a field file from a few questions, in the terminal or on a page."""

import shlex
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import click

from groundstation.cli.numbers import FiniteRange
from groundstation.errors import OperatorMistake, SettingsError

if TYPE_CHECKING:
    from groundstation.settings.new_field import NewDrone, NewRoom, NewTarget

_Answer = TypeVar("_Answer")


def _checked(check: Callable[[str], object]) -> Callable[[str], str]:
    """Return a converter of answers; if `check` raises ValueError with a reason, the question is asked again."""

    def answer(text: str) -> str:
        try:
            check(text)
        except ValueError as error:
            raise click.UsageError(f"{error} (got {text!r})") from None
        return text

    return answer


@click.command(
    epilog="\b\nExamples:\n  groundstation new my_lab\n  groundstation new my_lab --page\n"
    "  groundstation sitl my_lab/my_lab.yaml"
)
@click.argument("directory", type=click.Path(path_type=Path, file_okay=False))
@click.option("--page", is_flag=True, help="Ask on a page in the browser, which draws the room to scale.")
def new(directory: Path, page: bool) -> None:
    """Ask for room, camera, drones and target, draw the room, and write a commented field file into DIRECTORY."""
    from groundstation.settings.files import unwritable
    from groundstation.settings.shipped_copies import refuse_existing

    path = directory.resolve()
    path = path / f"{path.name}.yaml"
    refuse_existing([path])
    if why := unwritable(path.parent):  # reported before the first question
        raise OperatorMistake(f"{path.parent}: {why}")
    (_ask_on_page if page else _ask)(path)
    shown, typed = directory / path.name, shlex.quote(str(directory / path.name))
    click.echo(f"wrote {shown}\nnext: groundstation config check {typed}, then groundstation sitl {typed}")


def _ask(path: Path) -> None:
    from groundstation.recording.outputs import errors_named
    from groundstation.settings.new_field import field_text
    from groundstation.settings.shipped_copies import write_field

    click.echo("The floor's middle is the origin, x along the long side. Enter takes what stands in brackets.")
    room = _ask_room()
    drones = _ask_drones(room)
    text = field_text(path.stem, room, drones, _until_possible(lambda: _ask_target(room)))
    _require_good(text, path.name)
    if not click.confirm(f"Write {path}?", default=True):
        raise OperatorMistake("nothing was written")
    with errors_named(path):
        write_field(path, text)


def _require_good(text: str, name: str) -> None:
    """Raise SettingsError for conflicts between answers, such as one address for two drones."""
    from groundstation.settings.load import load_field
    from groundstation.settings.shipped_copies import write_field

    with tempfile.TemporaryDirectory() as folder:
        write_field(Path(folder) / name, text)
        try:
            load_field(Path(folder) / name)
        except SettingsError as error:
            raise SettingsError([problem.replace(f"{folder}/", "") for problem in error.problems]) from None


def _until_possible(ask: Callable[[], _Answer]) -> _Answer:
    """Ask impossible answers again, and keep all earlier ones."""
    while True:
        try:
            return ask()
        except OperatorMistake as mistake:
            click.echo(f"{mistake}. Once more:")


def _ask_room() -> "NewRoom":
    from drivers.camera.source_address import parse_source
    from groundstation.settings.new_field import NewRoom, check_room

    length = click.prompt("Length of the room [m]", default=8.0, type=FiniteRange(3, 60))
    width = click.prompt("Width [m]", default=6.0, type=FiniteRange(3, length))
    height = _until_possible(_ask_height)
    pictures = "http://192.168.1.50:8080/video.mjpg"
    source = click.prompt("Pictures of the ceiling camera", default=pictures, value_proc=_checked(parse_source))
    room = NewRoom(length, width, height, source)
    check_room(room)
    _draw(room, 0)
    return room


def _ask_height() -> float:
    from groundstation.settings.new_field import check_height

    height: float = click.prompt("Height [m]", default=4.5, type=FiniteRange(0))
    check_height(height)
    return height


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
    count = _until_possible(lambda: _ask_count(room))
    drones: list[NewDrone] = []
    for _ in range(count):
        drones.append(_until_possible(lambda: _ask_drone(room, drones)))
    return drones


def _ask_drone(room: "NewRoom", before: "list[NewDrone]") -> "NewDrone":
    from drivers.camera.source_address import parse_source
    from drivers.vehicle_settings import is_address
    from groundstation.settings.new_field import NewDrone, offers

    known, number = offers(), 1 + len(before)
    likely = before[-1].kind if before else next(iter(known))
    kind = click.prompt(f"Kind of drone_{number}", default=likely, type=click.Choice(tuple(known)))
    offer = known[kind][1]
    usual = f"192.168.1.{10 + number}" if offer.address in {"", *(one.address for one in before)} else offer.address
    address = click.prompt("  its address", default=usual, value_proc=_checked(is_address))
    own = offer.pictures.replace("{address}", address)
    pictures = click.prompt("  pictures of its camera", default=own, value_proc=_checked(parse_source))
    drone = NewDrone(kind, address, pictures)
    _require_apart(room, [*before, drone])
    return drone


def _require_apart(room: "NewRoom", drones: "list[NewDrone]") -> None:
    """Raise OperatorMistake for answers about the last drone that cannot be, such as the address of another one."""
    from groundstation.settings.new_field import NewTarget, field_text
    from groundstation.settings.wording import told

    try:
        _require_good(field_text("new", room, drones, NewTarget(board_m=0.0)), "new.yaml")
    except SettingsError as error:
        problems = [told(problem, "") for problem in error.problems]
        own = f"drones.drone_{len(drones)}."
        if texts := [problem.text for problem in problems if problem.path.startswith(own)]:
            raise OperatorMistake("; ".join(texts)) from None


def _ask_target(room: "NewRoom") -> "NewTarget":
    from groundstation.settings.new_field import BASES, NewTarget, check_target

    base = click.prompt("Target", default=next(iter(BASES)), type=click.Choice(tuple(BASES)))
    board = click.prompt("  height of the marker board on it [m]", default=BASES[base], type=FiniteRange(0, 3))
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
