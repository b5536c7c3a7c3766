"""Old runs are deleted for new ones, and nothing else in the folder is."""

import os
import shutil
from pathlib import Path

import pytest

from groundstation.flight.retention import KEEP, make_room
from groundstation.recording.cut import cut_run
from groundstation.recording.run import open_run
from groundstation.recording.synthetic import write_run
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field

NOW_S = 2_000_000_000.0


def run(parent: Path, name: str, megabytes: int = 1, age_s: float = 3600.0) -> Path:
    folder = parent / name
    (folder / "log").mkdir(parents=True)
    recording = folder / "state.mcap"
    with recording.open("wb") as file:
        file.truncate(megabytes * 1_000_000)
    for path in (recording, folder / "log"):
        os.utime(path, (NOW_S - age_s, NOW_S - age_s))
    return folder


def names(parent: Path) -> list[str]:
    return sorted(path.name for path in parent.iterdir())


def test_the_oldest_go_until_the_rest_fits(tmp_path: Path) -> None:
    for hour in range(4):
        run(tmp_path, f"20261120T1{hour}0000Z-lab", 10)
    removed = make_room(tmp_path, 0.025, NOW_S)
    assert [one.folder.name for one in removed] == ["20261120T100000Z-lab", "20261120T110000Z-lab"]
    assert names(tmp_path) == ["20261120T120000Z-lab", "20261120T130000Z-lab"]


def test_kept_unsettled_and_foreign_folders_stay(tmp_path: Path) -> None:
    (run(tmp_path, "20261120T100000Z-lab", 10) / KEEP).touch()
    run(tmp_path, "20261120T110000Z-lab", 10, age_s=5.0)
    run(tmp_path, "experiment-scenarios", 10)
    (tmp_path / "20261120T090000Z-link").symlink_to(run(tmp_path.parent / "elsewhere", "20261120T080000Z-lab", 10))
    assert make_room(tmp_path, 0.001, NOW_S) == []
    assert len(names(tmp_path)) == 4


def test_a_run_that_another_flight_removes_meanwhile_is_passed_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    vanishing, oldest = run(tmp_path, "20261120T110000Z-lab", 10), run(tmp_path, "20261120T100000Z-lab", 10)
    lstat = Path.lstat

    def removed_before(path: Path) -> os.stat_result:
        if path == vanishing / "state.mcap":
            shutil.rmtree(vanishing)
        return lstat(path)

    monkeypatch.setattr(Path, "lstat", removed_before)
    assert [one.folder for one in make_room(tmp_path, 0.001, NOW_S)] == [oldest]


def test_without_a_limit_or_a_folder_nothing_happens(tmp_path: Path) -> None:
    run(tmp_path, "20261120T100000Z-lab", 10)
    assert make_room(tmp_path, 0.0, NOW_S) == []
    assert make_room(tmp_path / "none", 1.0, NOW_S) == []
    assert names(tmp_path) == ["20261120T100000Z-lab"]


def test_cuts_of_a_run_are_never_deleted(tmp_path: Path) -> None:
    """A cut is beside its run under a similar name, and was made to be kept."""
    flown = tmp_path / "20261120T100000Z-lab"
    flown.mkdir()
    write_run(flown, load_field(find_field("lab"), ()).model_dump_json().encode(), 0.5)
    cut_run(open_run(flown), flown, 0.1, 0.3, None)
    assert [one.folder for one in make_room(tmp_path, 1e-6, NOW_S)] == [flown]
    assert names(tmp_path) == ["20261120T100000Z-lab-0.1s-0.3s"]
