"""Trend over many runs: by time, without re-runs, with the reason of each failure, damage named."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from groundstation.cli.report import report as report_command
from groundstation.errors import OperatorMistake
from groundstation.report.page.trend import NAME, write_trend
from groundstation.report.trend import judged_runs


def write(folder: Path, name: str, passed: bool | None = True, rmse_m: float | None = 0.02, **more: object) -> None:
    (folder / name).mkdir()
    criterion = {"name": "target_rmse_m", "value": rmse_m, "relation": "<=", "limit": 0.2, "ok": bool(passed)}
    content = {"passed": passed, "valid": True, "criteria": [criterion], "run": {"mode": "sitl"}}
    (folder / name / "report.json").write_text(json.dumps({**content, "target_rmse_m": rmse_m, **more}))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write(tmp_path, "20261120T110000Z-lab", passed=False, rmse_m=0.31)
    write(tmp_path, "20261120T100000Z-lab")
    write(tmp_path, "20261120T120000Z-lab", passed=None, rerun={"kind": "re-run"})
    write(tmp_path, "20261120T130000Z-lab", passed=True, rmse_m=None, topology_switches=3)
    return tmp_path


def test_runs_stand_in_order_of_time_without_re_runs(folder: Path) -> None:
    runs, damage = judged_runs(folder)
    assert [(run.name[9:11], run.verdict, run.figures["target_rmse_m"]) for run in runs] == [
        ("10", "passed", 0.02),
        ("11", "failed", 0.31),
        ("13", "passed", None),
    ]
    assert not damage
    assert [one.name for one in runs[1].missed] == ["target_rmse_m"]
    assert runs[2].figures["topology_switches"] == 3.0


def test_the_page_draws_figures_and_says_why(folder: Path) -> None:
    write_trend(*judged_runs(folder), folder / NAME)
    text = (folder / NAME).read_text()
    assert "3 runs, 2 passed" in text
    assert "target error (rms) 0.31 m, asked for at most 0.2 m" in text
    assert '"values":[0.02,0.31,null]' in text


def test_the_page_names_a_failure_that_no_criterion_shows(folder: Path) -> None:
    write(folder, "20261120T140000Z-lab", passed=False, reasons=["a process died"], criteria=[])
    write_trend(*judged_runs(folder), folder / NAME)
    assert "a process died" in (folder / NAME).read_text()


def test_a_damaged_report_is_named_and_the_others_count(folder: Path) -> None:
    (folder / "20261120T100000Z-lab" / "report.json").write_text("{")
    found = CliRunner().invoke(report_command, [str(folder), "--trend"], standalone_mode=False)
    assert found.exception is None
    assert "2 runs, 1 passed" in found.output
    assert "cannot be read: " in found.output + found.stderr


def test_a_folder_without_reports_is_refused(tmp_path: Path) -> None:
    found = CliRunner().invoke(report_command, [str(tmp_path), "--trend"], standalone_mode=False)
    assert isinstance(found.exception, OperatorMistake)


def test_a_run_of_any_name_is_shown(folder: Path) -> None:
    for name in ("20261120T140000Z-\udcff", "20261120T150000Z-\udcff"):
        write(folder, name)
    (folder / name / "report.json").write_text("{")
    found = CliRunner().invoke(report_command, [str(folder), "--trend"], standalone_mode=False)
    assert found.exception is None and "4 runs, 3 passed" in found.output
    assert "20261120T140000Z-\N{REPLACEMENT CHARACTER}" in (folder / NAME).read_text()
