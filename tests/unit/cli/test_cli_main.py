"""The command line: help, exit codes, messages, and no slow imports."""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest

from groundstation import __main__ as program
from groundstation.cli import main as cli
from groundstation.cli.exits import ExitCode, UnreachableError, exit_code_of
from groundstation.cli.verbs import VERBS, CommandRow, all_verbs
from groundstation.errors import DriverError, GroundStationError, SettingsError
from groundstation.settings.files import SHIPPED

FIXTURE = Path(__file__).parents[2] / "fixtures" / "field"


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a copy of the fixture, as working directory."""
    shutil.copytree(FIXTURE, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_help_shows_every_verb_without_importing_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["help", "all"]) == 0
    text = capsys.readouterr().out
    for name, verb in all_verbs().items():
        assert name in text
        assert verb.summary.split(";")[0].split(",")[0] in " ".join(text.split())
    assert "Exit codes" in text
    assert "130" in text


def test_an_unknown_verb_is_answered_with_the_likely_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["lnad"]) == ExitCode.SETTINGS
    assert "There is no command 'lnad'. Did you mean 'land'?" in capsys.readouterr().err
    assert cli.run(["version", "--jsn"]) == ExitCode.SETTINGS


@pytest.mark.parametrize(
    ("word", "meant"),
    [
        ("stop", "'land', 'hold' or 'cut-motors'"),
        ("hepl", "'help'"),
        ("check", "'config check'"),
        ("compare", "'report RUN --compare"),
        ("probe", "'ardrone probe' or 'mavlink probe'"),
    ],
)
def test_words_of_other_ground_stations_lead_to_ours(word: str, meant: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run([word]) == ExitCode.SETTINGS
    assert f"Did you mean {meant}" in capsys.readouterr().err


def test_a_folder_in_place_of_a_field_file_is_answered_with_the_files_in_it(
    lab: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(lab.parent)
    for name in (lab.name, f"{lab.name}/"):
        assert cli.run(["config", "check", name]) == ExitCode.SETTINGS
        assert f"is a folder, not a field file; in it: {lab.name}/lab.yaml" in capsys.readouterr().err


def test_each_verb_is_where_the_table_says() -> None:
    for name, verb in all_verbs().items():
        module, _, function = verb.target.partition(":")
        path = Path(cli.__file__).parents[2] / (module.replace(".", "/") + ".py")
        if path.is_file():
            command = cli.groundstation.get_command(click.Context(cli.groundstation), name)
            assert command is not None, f"{name}: {function}"


@pytest.mark.parametrize("seconds", ["nan", "inf", "-1", "0", "soon"])
def test_a_duration_that_never_ends_is_refused(seconds: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["sitl", "lab", "--duration", seconds]) == ExitCode.SETTINGS
    assert "--duration" in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--from=nan", "--from=inf", "--speed=nan"])
def test_a_replay_begins_and_runs_at_numbers(option: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["replay", option]) == ExitCode.SETTINGS
    assert option.partition("=")[0] in capsys.readouterr().err


@pytest.mark.parametrize("name", sorted(all_verbs()))
def test_each_verb_has_examples_in_its_help(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    module = all_verbs()[name].target.partition(":")[0]
    if not (Path(cli.__file__).parents[2] / (module.replace(".", "/") + ".py")).is_file():
        pytest.skip(f"{module} is not there")
    assert cli.run([name, "--help"]) == 0
    assert f"groundstation {name}" in capsys.readouterr().out.partition("\n\n")[2]


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (SettingsError(["a"]), 2),
        (click.UsageError("a"), 2),
        (UnreachableError("a"), 3),
        (DriverError("a"), 4),
        (GroundStationError("a"), 4),
        (OSError("a"), 4),
        (FileNotFoundError(2, "No such file or directory", "a"), 2),
        (OSError(28, "No space left on device", "a"), 4),
        (KeyboardInterrupt(), 130),
        (click.Abort(), 130),
        (ZeroDivisionError(), 70),
    ],
)
def test_exit_codes(error: BaseException, code: int) -> None:
    assert exit_code_of(error) == code


@pytest.mark.parametrize(
    ("error", "expected"),
    [
        (DriverError("drone_1 does not answer"), "groundstation: drone_1 does not answer\n"),
        (SettingsError(["a:1: b", "a:2: c"]), "a:1: b\na:2: c\n2 problems: nothing was started\n"),
        (PermissionError(13, "Permission denied", "/a/b"), "groundstation: /a/b: Permission denied\n"),
        (
            OSError(24, "Too many open files", "/a/b.py"),
            "groundstation: Too many open files: raise what this shell allows (ulimit -n 1024)\n",
        ),
        (KeyboardInterrupt(), "\ninterrupted\n"),
    ],
)
def test_errors_are_told_without_a_traceback(
    error: BaseException,
    expected: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail() -> None:
        raise error

    monkeypatch.setitem(VERBS, "broken", CommandRow("Look", f"{__name__}:broken", "Fails."))
    monkeypatch.setattr(cli.VerbGroup, "get_command", lambda *_: click.Command("broken", callback=fail))
    assert cli.run(["broken"]) == exit_code_of(error)
    assert capsys.readouterr().err == expected


def test_mixed_installations_are_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    real = importlib.util.find_spec

    class Elsewhere:
        origin = str(tmp_path / "drivers" / "__init__.py")

    monkeypatch.setattr(cli, "find_spec", lambda name: Elsewhere() if name == "drivers" else real(name))
    with pytest.raises(GroundStationError, match="come from different places"):
        cli.check_installation()
    monkeypatch.setattr(cli, "find_spec", lambda name: None)
    with pytest.raises(GroundStationError, match="is not installed"):
        cli.check_installation()


def test_start_up_imports_nothing_heavy() -> None:
    """`land` must be quick: only click and the table are loaded before its module."""
    code = "import sys, groundstation.__main__, groundstation.cli.main; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True).stdout
    heavy = {"numpy", "pydantic", "ruamel.yaml", "zenoh", "msgspec", "rich", "scipy", "numba", "cv2", "matplotlib"}
    assert not heavy & set(loaded.split())


@pytest.mark.parametrize("verb", VERBS)
def test_stop_commands_and_their_bus_run_at_raised_priority(monkeypatch: pytest.MonkeyPatch, verb: str) -> None:
    done: list[str] = []
    monkeypatch.setattr(program, "go_first", lambda *, heirs: done.append(f"first {heirs}"))
    monkeypatch.setattr(cli, "main", lambda: done.append("carried out"))
    monkeypatch.setattr(sys, "argv", ["groundstation", verb])
    program.main()
    lasts = verb == "deadman"  # and drones hold if it is late
    assert done == (["first True"] if VERBS[verb].family == "Stop" and not lasts else []) + ["carried out"]


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["version", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["skein-groundstation"] == "0.1.0"
    assert found["location"] == str(Path(cli.__file__).parents[2])
    assert cli.run(["version"]) == 0
    assert "eclipse-zenoh" in capsys.readouterr().out
    assert cli.run(["--version"]) == 0
    assert capsys.readouterr().out == "skein-groundstation 0.1.0\n"


@pytest.mark.parametrize("words", [[], ["land"], ["config", "check"]])
def test_help_is_a_word_too(capsys: pytest.CaptureFixture[str], words: list[str]) -> None:
    assert cli.run(["help", *words]) == 0
    asked = capsys.readouterr().out
    assert cli.run([*words, "--help"]) == 0
    assert asked == capsys.readouterr().out
    assert "Usage: groundstation" in asked


@pytest.mark.usefixtures("lab")
def test_config_check(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["config", "check", "lab.yaml"]) == 0
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err == "lab.yaml: good (2 drone(s), 1 fixed camera(s), target turtlebot)\n"
    assert cli.run(["config", "check", "lab.yaml", "--set", "planner.discount=2", "--set", "site=X"]) == 2
    assert capsys.readouterr().err.splitlines() == [
        "--set planner.discount=2: planner.discount: must be <= 1 (got 2)",
        '--set site=X: site: must be a name such as drone_1 (a-z first, then a-z, 0-9, _) (got "X")',
        "2 problems: nothing was started",
    ]


@pytest.mark.usefixtures("lab")
def test_config_check_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["config", "check", "lab.yaml", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"ok": True, "problems": [], "findings": []}
    foolish = ["config", "check", "lab.yaml", "--json", "--set", "safety.max_position_std_m=0.01"]
    assert cli.run(foolish) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["ok"] is True and answer["problems"] == []
    assert [(one["path"], one["level"]) for one in answer["findings"]] == [("safety.max_position_std_m", "WARNING")]
    assert cli.run(["config", "check", "lab.yaml", "--json", "--scenario", "nosuch"]) == 2
    answer = json.loads(capsys.readouterr().out)
    assert answer["ok"] is False
    assert answer["problems"][0].startswith("there is no scenario 'nosuch'")


@pytest.mark.usefixtures("lab")
def test_config_show(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["config", "show", "lab.yaml", "--set", "drones.drone_2.enabled=false"]) == 0
    text = capsys.readouterr().out
    assert "drone drone_1" in text
    assert "drone_2" not in text
    assert cli.run(["config", "show", "lab.yaml", "--resolved"]) == 0
    resolved = capsys.readouterr().out
    Path("resolved.yaml").write_text(resolved, encoding="utf-8")
    assert cli.run(["config", "check", "resolved.yaml"]) == 0
    capsys.readouterr()
    assert cli.run(["config", "show", "resolved.yaml", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["drones"]["drone_1"]["odometry"]["velocity_scale"] == 1.18


def test_config_schema(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["config", "schema"]) == 0
    assert json.loads(capsys.readouterr().out)["title"] == "Field file"


@pytest.mark.parametrize("like", sorted(path.stem for path in SHIPPED.glob("*.yaml")))
def test_every_shipped_field_can_be_begun_with(like: str, tmp_path: Path) -> None:
    assert cli.run(["config", "init", str(tmp_path), "--like", like]) == 0
    assert cli.run(["config", "check", str(tmp_path / f"{like}.yaml")]) == 0


def test_config_init_starts_a_field_and_overwrites_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "mine"
    assert cli.run(["config", "init", str(folder)]) == 0
    assert cli.run(["config", "check", str(folder / "lab.yaml"), "--scenario", "realistic"]) == 0
    (folder / "lab.yaml").write_text("mine", encoding="utf-8")
    capsys.readouterr()
    assert cli.run(["config", "init", str(folder)]) == 2
    assert "is there already; nothing was written" in capsys.readouterr().err
    assert (folder / "lab.yaml").read_text(encoding="utf-8") == "mine"


def test_config_draw(lab: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["config", "draw", "lab.yaml", "--scenario", "realistic", "--output", "room.svg"]) == 0
    text = (lab / "room.svg").read_text(encoding="utf-8")
    assert text.count("<path") > 20
    table = ("--set", "room.obstacles={table: {centre_m: [2, 1], size_m: [1, 1, 0.7]}}")
    assert cli.run(["config", "draw", "lab.yaml", "--scenario", "realistic", *table, "--output", "table.svg"]) == 0
    assert (lab / "table.svg").read_text(encoding="utf-8").count("<path") > text.count("<path") + 2
    assert cli.run(["config", "draw", "lab.yaml", "--output", "room.txt"]) == 2
    assert "must end in .png, .svg or .pdf" in capsys.readouterr().err


def test_the_first_page_names_a_dozen_commands(capsys: pytest.CaptureFixture[str]) -> None:
    cli.run(["--help"])
    first = capsys.readouterr().out
    named = {name for name in all_verbs() if re.search(rf"^  {name} ", first, re.MULTILINE)}
    assert 0 < len(named) <= 12 and {"demo", "fly", "land"} <= named


@pytest.mark.parametrize("encoding", ["utf-8:strict", "latin-1"])
def test_characters_that_a_terminal_cannot_show_are_no_error(tmp_path: Path, encoding: str) -> None:
    """With a locale, Python encodes stdout strictly: a path typed as bytes ended in a traceback."""
    typed = os.fsencode(tmp_path) + b"/\xff"
    command = [os.fsencode(sys.executable), b"-m", b"groundstation", b"config", b"init", typed]
    told = {**os.environ, "PYTHONIOENCODING": encoding}
    done = subprocess.run(command, capture_output=True, timeout=60, check=False, env=told)
    assert done.returncode == 0, done.stderr
    assert rb"\udcff/lab.yaml" in done.stdout and not done.stderr


def test_an_interrupt_that_a_library_turned_into_another_error_is_no_bug(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def compiles() -> int:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt:
            raise RuntimeError("no compiled object yet")  # noqa: B904 - as numba does

    monkeypatch.setattr(cli, "run", compiles)
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == ExitCode.INTERRUPTED and "Traceback" not in capsys.readouterr().err
