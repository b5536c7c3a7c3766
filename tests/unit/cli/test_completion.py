"""Shell completion, set up by the line in commands-by-task.md."""

from pathlib import Path

from click.shell_completion import BashComplete

from groundstation.cli.main import groundstation

PAGE = Path(__file__).parents[3] / "docs" / "how-to" / "commands-by-task.md"
VARIABLE = "_GROUNDSTATION_COMPLETE"


def completed(arguments: list[str], begun: str) -> list[str]:
    shell = BashComplete(groundstation, {}, "groundstation", VARIABLE)
    return [str(item.value) for item in shell.get_completions(arguments, begun)]


def test_commands_and_options_are_completed() -> None:
    assert completed([], "pre") == ["preflight"]
    assert "draw" in completed(["config"], "")
    assert completed(["fly"], "--head") == ["--headless"]


def test_the_page_names_the_variable_that_asks_for_it() -> None:
    assert f"{VARIABLE}=bash_source groundstation" in PAGE.read_text("utf-8")
