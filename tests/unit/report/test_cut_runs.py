"""Excerpts of a run and checks before a take-off are no flight: neither judged, nor counted, nor the newest run."""

import json
import os
import shutil
from pathlib import Path

import pytest

from groundstation.cli.main import run
from groundstation.cli.report import newest_run
from groundstation.recording.cut import cut_run
from groundstation.recording.run import open_run
from groundstation.recording.stretch import is_stretch
from groundstation.recording.synthetic import write_run
from groundstation.report import run_facts
from groundstation.report.build import build_report
from groundstation.report.run_facts import RunFacts
from groundstation.report.trend import judged_runs
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a flight and, written later, a cut of it and what a check before a take-off wrote."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "flight").mkdir()
    write_run(folder / "flight", load_field(find_field("lab"), ()).model_dump_json().encode(), 2.0)
    os.utime(folder / "flight" / "state.mcap", (1, 1))
    cut_run(open_run(folder / "flight"), folder / "flight", 0.5, 1.5, folder / "part")
    (folder / "looked").mkdir()
    shutil.copy(folder / "flight" / "state.mcap", folder / "looked")
    run_facts.write(folder / "looked", RunFacts(mode="preflight"))
    return folder


def test_it_is_not_judged(runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    report = build_report(runs / "part", plot=False)
    assert (report.passed, report.verdict, report.criteria) == (None, "cut", ())
    assert json.loads((runs / "part" / "report.json").read_text())["cut"].keys() == {"from_unix_ns", "until_unix_ns"}
    assert run(["report", str(runs / "part")]) == 0
    assert "CUT of 1.0 s from a recording" in capsys.readouterr().out
    page = (runs / "part" / "report.html").read_text()
    assert "A cut is no flight: no criterion applies." in page and "is a cut of 1.0 s" in page


def test_it_counts_in_no_trend(runs: Path) -> None:
    for name in ("flight", "part", "looked"):
        build_report(runs / name, plot=False)
    assert [one.name for one in judged_runs(runs)[0]] == ["flight"]


def test_a_command_without_a_name_takes_the_flight(runs: Path) -> None:
    assert is_stretch(runs / "part" / "state.mcap") and not is_stretch(runs / "flight" / "state.mcap")
    assert newest_run(runs).name == "flight"


def test_a_check_before_a_take_off_is_not_judged(runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    report = build_report(runs / "looked", plot=False)
    assert (report.passed, report.verdict, report.criteria) == (None, "check", ())
    assert run(["report", str(runs / "looked")]) == 0
    assert "CHECK before a take-off, in which no drone flies: nothing is judged" in capsys.readouterr().out
    assert "is a check before a take-off" in (runs / "looked" / "report.html").read_text()
