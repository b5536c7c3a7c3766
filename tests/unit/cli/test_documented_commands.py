"""Every `groundstation ...` and `python -m ...` shown in a README or help text is valid."""

import re
import shlex
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import click
import pytest

from groundstation.cli import main as cli
from groundstation.cli import verbs
from groundstation.errors import GroundStationError
from groundstation.flight.real_parts import parse_real
from groundstation.settings.files import SHIPPED
from groundstation.settings.load import load_field

ROOT = Path(__file__).parents[3]
DOCUMENTS = [
    ROOT / "README.md",
    ROOT / "CHANGELOG.md",
    ROOT / "config" / "README.md",
    *sorted((ROOT / "docs").rglob("*.md")),
]
DOCUMENTS += sorted(path for name in ("groundstation", "drivers", "sim_bridge") for path in (ROOT / name).rglob("*.md"))
DOCUMENTS = [path for path in DOCUMENTS if "shipped" not in path.parts]  # config/ once more

FENCED = re.compile(r"```\w*\n(.*?)```", re.S)
INLINE = re.compile(r"`([^`]+)`")
INDENTED = re.compile(r"^(?: {4,})(\S.*)$", re.M)
COMMAND = re.compile(r"(?:^|[^\w./=-])groundstation ([a-z].*)")
MODULE = re.compile(r"python -m ([\w.]+)")


def shown(text: str) -> Iterator[str]:
    """Yield the lines of code of a Markdown text; code that prose breaks over two lines is one."""
    for block in FENCED.findall(text):
        yield from re.sub(r"\s#.*", "", block.replace("\\\n", " ")).splitlines()
    prose = FENCED.sub("", text)
    yield from (re.sub(r"\s+", " ", code) for code in INLINE.findall(prose))
    yield from INDENTED.findall(prose)


def commands(groups: click.Command, path: str) -> Iterator[tuple[str, click.Command]]:
    yield path, groups
    if isinstance(groups, click.Group):
        context = click.Context(groups)
        for name in groups.list_commands(context):
            found = groups.get_command(context, name)
            assert found is not None
            yield from commands(found, f"{path} {name}".strip())


VERBS = dict(commands(cli.groundstation, ""))


def mistakes(line: str) -> Iterator[str]:
    """Yield the invalid parts in the arguments of `groundstation`."""
    words = shlex.split(line.split("  ")[0].split(" (")[0].split(" && ")[0].split(" | ")[0])
    command: click.Command = cli.groundstation
    while words and isinstance(command, click.Group):
        alternatives = words.pop(0).strip(",.:;`").split("|")
        found = [command.get_command(click.Context(command), name) for name in alternatives if name[0] != "-"]
        if None in found:
            yield f"no verb {alternatives}"
        if len(found) != 1 or found[0] is None:
            return
        command = found[0]
    known = {name for parameter in command.params for name in (*parameter.opts, *parameter.secondary_opts)}
    for place, word in enumerate(words):
        name = word.partition("=")[0].strip("[],.;:)")
        if name.startswith("-") and name.lstrip("-") and not name[1:2].isdigit() and name not in known | {"--help"}:
            yield f"no option {name}"
        if word == "--set":
            load_field(SHIPPED / "lab.yaml", (words[place + 1],))
    yield from no_parts(words)


def no_parts(words: list[str]) -> Iterator[str]:
    """Yield names that are no part of a shipped field, where a command uses one."""
    named = [words[place + 1] for place, word in enumerate(words) if word == "--real" and place + 1 < len(words)]
    field = SHIPPED / f"{Path(words[0]).stem}.yaml" if named else SHIPPED
    if field.is_file():
        try:
            parse_real(load_field(field, ()), named)
        except GroundStationError as error:
            yield str(error)


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_commands_shown_in_documents_are_valid(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    wrong = []
    for line in shown(text):
        for found in COMMAND.findall(line):
            wrong += [f"groundstation {found}: {mistake}" for mistake in mistakes(found)]
        for module in MODULE.findall(line):
            if module.split(".")[0] in ("groundstation", "drivers", "sim_bridge") and find_spec(module) is None:
                wrong.append(f"no module {module}")
    assert not wrong, "\n".join(wrong)


def test_help_shows_what_can_be_typed() -> None:
    wrong = []
    for path, command in VERBS.items():
        for line in (command.epilog or "").replace("\\\n", " ").splitlines():
            for found in COMMAND.findall(line):
                wrong += [f"{path}: groundstation {found}: {mistake}" for mistake in mistakes(found)]
    assert not wrong, "\n".join(wrong)


def test_the_page_of_commands_names_every_verb() -> None:
    text = (ROOT / "docs" / "how-to" / "commands-by-task.md").read_text(encoding="utf-8")
    unnamed = [verb for verb in verbs.all_verbs() if not re.search(rf"groundstation {verb}\b", text)]
    assert not unnamed, unnamed


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_of_a_document_lead_somewhere(path: Path) -> None:
    links = re.findall(r"\]\(([^)#\s]+)\)", path.read_text(encoding="utf-8"))
    # Generated pages exist once the site is built; the build resolves links to them.
    kept = [link for link in links if "://" not in link and "/generated/" not in link]
    lost = [link for link in kept if not (path.parent / link).exists()]
    assert not lost, lost


def test_help_aims_no_calibration_at_the_shipped_lenses() -> None:
    """In a checkout the default output is there already, and is that of the shipped fields."""
    for path in ("calibrate", "calibrate camera"):
        examples = [line for line in (VERBS[path].epilog or "").splitlines() if "calibrate camera" in line]
        assert examples and all(" -o my_lab/cameras/" in line for line in examples), path
