"""The form's messages and their replies: a drawing of the room, the field file, mistakes and warnings."""

import tempfile
from pathlib import Path
from typing import Literal

import msgspec

from groundstation.errors import MessageError, OperatorMistake, SettingsError
from groundstation.settings import drawing
from groundstation.settings.load import cautions_of, load_field
from groundstation.settings.new_field import NewDrone, NewRoom, NewTarget, field_text, offers
from groundstation.settings.shipped_copies import write_field


class Answers(msgspec.Struct, forbid_unknown_fields=True):
    """The present form; `order`: only draw, or write the field file as well."""

    number: int
    order: Literal["draw", "write"]
    room: NewRoom
    drones: list[NewDrone]
    target: NewTarget


class Reply(msgspec.Struct):
    """The reply that the page shows. `number`: of the answers; `problem`: why there is no drawing.

    `written`: the file, if so.
    """

    number: int
    svg: str = ""
    text: str = ""
    problem: str = ""
    warnings: list[str] = []
    written: str = ""


def offers_script() -> bytes:
    """Return the script that tells the page the types of drones: titles, addresses and those of pictures, by name."""
    shown = {
        name: {"title": one.title or name, "pictures": one.pictures, "address": one.address}
        for name, (_, one) in offers().items()
    }
    return b"export const OFFERS = " + msgspec.json.encode(shown) + b";\n"


def decode(frame: str | bytes) -> Answers:
    """Return the answers of a page; raises MessageError."""
    try:
        answers = msgspec.json.decode(frame, type=Answers)
    except (msgspec.DecodeError, UnicodeError) as error:
        raise MessageError(f"not the form's answers: {error}") from error
    if unknown := [drone.kind for drone in answers.drones if drone.kind not in offers()]:
        raise MessageError(f"not a kind of drone: {unknown[0]}")
    return answers


def reply_to(answers: Answers, path: Path) -> Reply:
    """Return the drawing and the text of the field that these answers make; `order` "write" writes it to `path`."""
    reply = Reply(answers.number)
    try:
        reply.text = field_text(path.stem, answers.room, answers.drones, answers.target)
        reply.svg, reply.warnings = _sketch(reply.text, path.name)
        if answers.order == "write":
            write_field(path, reply.text)
            reply.written = str(path)
    except (OperatorMistake, SettingsError) as error:
        reply.problem = str(error)
    except OSError as error:
        reply.problem = f"{path} cannot be written: {error.strerror or error}"
    return reply


def _sketch(text: str, name: str) -> tuple[str, list[str]]:
    """Return the drawing (SVG) of a field file and its warnings; raises SettingsError for its mistakes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        write_field(path, text)
        try:
            field = load_field(path)
        except SettingsError as error:
            raise SettingsError([problem.replace(f"{folder}/", "") for problem in error.problems]) from error
        picture = Path(folder) / "room.svg"
        drawing.draw(field, picture)
        return picture.read_text(encoding="utf-8"), [line.replace(f"{folder}/", "") for line in cautions_of(path)]
