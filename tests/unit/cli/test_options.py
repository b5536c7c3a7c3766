"""An option name has one meaning in the whole command line, and old spellings suggest today's."""

import re
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from groundstation.cli import main as cli
from groundstation.cli.exits import ExitCode
from groundstation.cli.verbs import RENAMED

MEANINGS = {
    "--calibration": r"calibration",
    "--dictionary": r"tags of th",
    "--duration": r"Seconds of tracking",
    "--field": r"field file",
    "--frames": r"pictures",
    "--from": r"Begin .*start",
    "--headless": r"Plain lines instead of the live table",
    "--json": r"^Print .*JSON|^Print report\.json",
    "--output": r"^Write|Where to|[Ff]older|[Ff]ile|PDF",
    "--port": r"Port .*serve",
    "--robots": r"Team size",
    "--rounds": r"Number of rounds",
    "--run": r"run",
    "--scenario": r"scenario",
    "--scheduler": r"dask",
    "--seconds": r"How long",
    "--seed": r"Seed",
    "--seeds": r"Number of (runs|flights)|Flights of each",
    "--set": r"setting",
    "--square-mm": r"Side of",
    "--strategies": r"Strategies",
}
"""What an option that several commands have means: each of its helps says so."""


def options_of(command: click.Command, context: click.Context, path: str = "") -> Iterator[tuple[str, click.Option]]:
    """Yield all visible options, with their command."""
    yield from ((path, p) for p in command.params if isinstance(p, click.Option) and not p.hidden)
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            below = command.get_command(context, name)
            assert below is not None
            yield from options_of(below, context, f"{path} {name}".strip())


@pytest.fixture(scope="module")
def shared() -> dict[str, dict[str, click.Option]]:
    """Return the options of two or more commands: by name, then by command."""
    found: dict[str, dict[str, click.Option]] = {}
    for command, option in options_of(cli.groundstation, click.Context(cli.groundstation)):
        for name in option.opts:
            found.setdefault(name, {})[command] = option
    return {name: having for name, having in found.items() if len(having) > 1}


def test_an_option_takes_a_value_everywhere_or_nowhere(shared: dict[str, dict[str, click.Option]]) -> None:
    for name, having in shared.items():
        assert len({option.is_flag for option in having.values()}) == 1, (name, sorted(having))
        assert len({option.multiple for option in having.values()}) == 1, (name, sorted(having))


def test_an_option_means_the_same_everywhere(shared: dict[str, dict[str, click.Option]]) -> None:
    for name, having in shared.items():
        helps = {option.help or "" for option in having.values()}
        if not name.startswith("--") or len(helps) == 1:
            continue
        assert name in MEANINGS, f"{name} is explained differently: {helps}"
        for text in helps:
            assert re.search(MEANINGS[name], text, re.IGNORECASE), (name, text)


def test_a_short_option_stands_for_one_long_one(shared: dict[str, dict[str, click.Option]]) -> None:
    for name, having in shared.items():
        if not name.startswith("--"):
            assert len({tuple(option.opts) for option in having.values()}) == 1, (name, sorted(having))
    output = shared["--output"]
    assert all("-o" in option.opts for option in output.values()), sorted(output)


@pytest.mark.parametrize(
    ("command", "old", "new"),
    [(command, old, new) for command, names in RENAMED.items() for old, new in names.items()],
)
def test_an_old_spelling_is_answered_with_the_new_one(
    command: str, old: str, new: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run([*command.split(), old]) == ExitCode.SETTINGS
    assert f"{old} is {new} here." in capsys.readouterr().err
    assert cli.run([*command.split(), "--help"]) == 0
    assert re.search(rf"{new}\b", capsys.readouterr().out)


def test_a_file_for_json_is_answered_with_how_to_write_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.run(["replay", "--recompute", "--json", "verdict.json"]) == ExitCode.SETTINGS
    assert "write --json > verdict.json" in " ".join(capsys.readouterr().err.split())


def test_the_old_word_for_a_re_run_still_asks_for_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    cli.run(["replay", "empty", "--rerun", "tracker"])
    assert "--rerun tracker is --recompute now" in capsys.readouterr().err
    assert cli.run(["replay", "empty", "--json"]) == ExitCode.SETTINGS
    assert "--json belongs to a re-run: add --recompute" in capsys.readouterr().err
