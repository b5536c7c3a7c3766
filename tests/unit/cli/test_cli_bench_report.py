"""`bench demo` with a stand-in for the demo, and `report` on good and bad folders."""

import json
import os
import signal
import sys
from pathlib import Path
from typing import Any

import pytest

from groundstation.cli import bench_demo
from groundstation.cli.main import run
from groundstation.cli.report import newest_run

GOOD = {
    "passed": True, "valid": True, "criteria": [], "target_rmse_m": 0.12, "target_lost_s": 0.0,
    "max_fence_violation_m": 0.0, "min_separation_m": 0.9, "topology_seconds": {"flat": 40.0, "string": 20.0},
    "topology_switches": 4, "mean_cpu_cores": 1.4, "planner_p99_ms": 31.0, "tracker_missed_percent": 0.1,
}  # fmt: skip
BAD = GOOD | {"passed": False, "criteria": [{"name": "landed", "ok": False}, {"name": "target_rmse_m", "ok": True}]}


@pytest.fixture(autouse=True)
def keep_signals() -> Any:
    kept = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGHUP)}
    yield
    for number, handler in kept.items():
        signal.signal(number, handler)


def _stand_in(monkeypatch: pytest.MonkeyPatch, reports: dict[int, tuple[dict[str, Any] | None, int]]) -> None:
    def command(seed: int, _duration_s: float | None, folder: Path) -> list[str]:
        report, code = reports[seed]
        script = "import pathlib, sys; p = pathlib.Path(sys.argv[1]); p.mkdir(exist_ok=True)\n"
        if report is not None:
            script += "(p / 'report.json').write_text(sys.argv[2])\n"
        return [sys.executable, "-c", f"{script}sys.exit({code})", str(folder / "run"), json.dumps(report)]

    monkeypatch.setattr(bench_demo, "demo_command", command)


def test_all_passed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _stand_in(monkeypatch, {1: (GOOD, 0), 2: (GOOD, 0)})
    assert run(["bench", "demo", "--seeds", "2", "--output", str(tmp_path), "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert (content["passed"], content["flown"]) == (2, 2)
    assert content["runs"][1]["seed"] == 2
    assert content["runs"][0]["topology_seconds.string"] == 20.0


def test_one_failure_fails_the_bench(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _stand_in(monkeypatch, {5: (GOOD, 0), 6: (BAD, 1), 7: (None, 4)})
    assert run(["bench", "demo", "--seeds", "3", "--first", "5", "--output", str(tmp_path)]) == 1
    text = capsys.readouterr().out
    assert "2/3  seed 6: landed" in text
    assert "seed 7: no report (exit code 4)" in text
    assert "1 of 3 passed" in text


def test_a_report_of_an_earlier_bench_does_not_count(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    _stand_in(monkeypatch, {1: (None, 0)})
    (tmp_path / "seed-1").mkdir()
    (tmp_path / "seed-1" / "report.json").write_text(json.dumps(GOOD))
    assert run(["bench", "demo", "--seeds", "1", "--output", str(tmp_path), "--json"]) == 1


def test_a_demo_that_never_ends_is_asked_to_land(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    script = "import signal, sys, time; signal.signal(15, lambda *_: sys.exit(3)); time.sleep(60)"
    monkeypatch.setattr(bench_demo, "demo_command", lambda *_arguments: [sys.executable, "-c", script])
    monkeypatch.setattr(bench_demo, "_OVERHEAD_S", -58.5)
    outcome, interrupted = bench_demo.fly_one(1, None, tmp_path)
    assert outcome.exit_code in (3, -signal.SIGTERM)  # the latter if it had not installed its handler yet
    assert (interrupted, outcome.passed) == (False, False)


def test_the_command_passes_seed_duration_and_folder(tmp_path: Path) -> None:
    command = bench_demo.demo_command(4, 30.0, tmp_path)
    assert command[3:] == ["demo", "--headless", "--seed", "4", "--duration", "30", "--output", str(tmp_path)]


def test_bench_help_lists_benches(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["bench", "--help"]) == 0
    assert "Fly the demo once per seed" in capsys.readouterr().out


def test_report_names_a_folder_without_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["report", str(tmp_path)]) == 2
    assert "no state.mcap in this folder" in capsys.readouterr().err


def test_report_names_the_file_that_is_no_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "flight.ulg").write_bytes(b"ULog")
    assert run(["report", str(tmp_path / "flight.ulg")]) == 2
    assert "flight.ulg: no recording of a run" in capsys.readouterr().err


def test_report_without_argument_takes_the_newest(tmp_path: Path) -> None:
    for index, name in enumerate(("b", "a")):
        (tmp_path / name).mkdir()
        recording = tmp_path / name / "state.mcap"
        recording.write_bytes(b"x")
        os.utime(recording, (index, index))
    assert newest_run(tmp_path).name == "a"
    (tmp_path / "b" / "state-recovered.mcap").write_bytes(b"x")
    assert newest_run(tmp_path).name == "a", "a copy of an old one is no new run"


def test_report_where_nothing_was_recorded_is_a_mistake_of_usage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for arguments in (["report"], ["report", "gone"], ["replay"]):
        assert run(arguments) == 2
        assert str(tmp_path / "runs") in (said := capsys.readouterr().err) or "gone: there is no such run" in said
