"""Output paths of exports: a wrong path is a usage error, a full disk leaves the old file."""

import errno
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from groundstation.cli.exits import ExitCode, exit_code_of
from groundstation.cli.main import groundstation, run
from groundstation.recording.outputs import OutputError, replaced_file
from groundstation.recording.run import open_run
from groundstation.recording.synthetic import write_run
from groundstation.recording.table_files import ParquetFile, write_tables
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field

FULL = OSError(errno.ENOSPC, "No space left on device")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole")
    write_run(folder, load_field(find_field("lab"), ()).model_dump_json().encode(), 1.0)
    return folder


@pytest.fixture
def cut_off(whole: Path, tmp_path: Path) -> Path:
    """Return a state file as after kill -9."""
    data = (whole / "state.mcap").read_bytes()
    (tmp_path / "state.mcap").write_bytes(data[: len(data) * 2 // 3])
    return tmp_path / "state.mcap"


def _error(*arguments: object) -> Exception | None:
    words = [str(one) for one in ("recording", *arguments)]
    error = CliRunner().invoke(groundstation, words, standalone_mode=False).exception
    assert error is None or isinstance(error, Exception)
    return error


def _refusal(*arguments: object) -> tuple[ExitCode, str]:
    error = _error(*arguments)
    assert error is not None
    return exit_code_of(error), str(error)


@pytest.mark.parametrize(
    "command",
    [
        ("export", "--csv"),
        ("export", "--parquet"),
        ("export", "--rrd"),
        ("export", "--foxglove-scene"),
        ("export", "--rosbag2"),
        ("cut", "--from", "0", "--to", "1"),
        ("recover",),
    ],
    ids=" ".join,
)
def test_a_place_that_cannot_be_is_wrong_usage(cut_off: Path, tmp_path: Path, command: tuple[str, ...]) -> None:
    """A full disk is a fault; a path below a file is a usage error, and ends each command with the same code."""
    (tmp_path / "taken").write_text("")
    code, text = _refusal(*command, cut_off, "-o", tmp_path / "taken" / "out")
    assert code is ExitCode.SETTINGS and "taken/out" in text and "name another place" in text


def test_a_run_of_any_name_can_be_exported(whole: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run\udcff"
    shutil.copytree(whole, folder)
    assert write_tables(open_run(folder), folder / "tables", ParquetFile)[0]
    code, text = _refusal("export", "--rrd", folder)
    assert code is ExitCode.SETTINGS and "is no UTF-8 text" in text
    assert _error("export", "--rrd", folder, "-o", tmp_path / "flight.rrd") is None


def test_a_full_disk_leaves_the_old_file(tmp_path: Path) -> None:
    place = tmp_path / "lens.yaml"
    place.write_text("old")
    told = r"lens\.yaml: No space left on device: make room"
    with pytest.raises(OutputError, match=told), replaced_file(place) as new:
        new.write_text("half")
        raise FULL
    assert [(path, path.read_text()) for path in tmp_path.iterdir()] == [(place, "old")]
    with replaced_file(place) as new:
        new.write_text("new")
    assert [(path, path.read_text()) for path in tmp_path.iterdir()] == [(place, "new")]


def test_half_a_sheet_is_not_left_to_be_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def half(path: Path, data: bytes) -> int:
        with path.open("wb") as stream:
            stream.write(data[: len(data) // 2])
        raise FULL

    monkeypatch.setattr(Path, "write_bytes", half)
    assert run(["markers", "print", "--id", "1", "-o", str(tmp_path / "m.pdf")]) == ExitCode.FAULT
    assert f"{tmp_path}/m.pdf: No space left on device: make room" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_copy_that_cannot_be_made_is_named_by_its_own_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Python names the copied source: an operator read that the program's own file had no space."""

    def half(source: Path, target: Path) -> None:
        target.write_text("half")
        raise OSError(errno.ENOSPC, "No space left on device", str(source))

    monkeypatch.setattr(shutil, "copyfile", half)
    assert run(["config", "init", str(tmp_path / "lab")]) == ExitCode.FAULT
    assert f"{tmp_path}/lab/lab.yaml: No space left on device: make room" in capsys.readouterr().err
    assert not list((tmp_path / "lab").iterdir())
