"""The report of synthetic recordings with known results."""

import json
import math
from pathlib import Path

import pytest
from rich.console import Console
from taped_flight import STRING, UNIX, Flight, S, Tape, fly, statuses

from groundstation.cli.main import run
from groundstation.recording.reader import RecordingError
from groundstation.report import run_facts
from groundstation.report.build import build_report
from groundstation.report.gather import gather
from groundstation.report.judge import judge
from groundstation.report.run_facts import RunFacts
from groundstation.report.summary import summary
from groundstation.report.trend import judged_runs


def test_figures_of_a_good_flight(tmp_path: Path) -> None:
    report = build_report(fly(tmp_path, Flight()), plot=False)
    figures = report.figures
    assert report.passed, [criterion for criterion in report.criteria if not criterion.ok]
    assert figures.tracked_s == pytest.approx(20.0)
    assert figures.target_rmse_m == pytest.approx(0.1, abs=1e-3)
    assert figures.target_lost_s == 0.0
    assert figures.target is not None
    assert figures.target.anees == pytest.approx(0.1**2 / 0.005 / 2, rel=0.05)
    assert figures.robots["drone_1"].rmse_m == pytest.approx(0.05, abs=0.02)
    assert figures.robots["drone_1"].yaw_rmse_rad == pytest.approx(2 * math.pi - 6.2, abs=1e-6)
    assert figures.max_fence_violation_m == 0.0
    assert figures.min_separation_m == pytest.approx(1.0)
    assert figures.landed is True
    assert figures.topology_seconds["flat"] == pytest.approx(10.0, abs=0.11)
    assert figures.topology_seconds["string"] == pytest.approx(10.0, abs=0.11)
    assert figures.topology_seconds[STRING] == figures.topology_seconds["string"]
    assert figures.topology_switches == 1
    assert figures.planner_p50_ms == pytest.approx(10.0)
    assert figures.planner_p99_ms == pytest.approx(30.0)
    assert figures.tracker_rate_hz == pytest.approx(50.0)
    assert figures.mean_cpu_cores == pytest.approx(0.9)
    assert figures.events == {"WARNING": 1}
    assert figures.command_to_airborne_s is None


def test_report_json_has_the_figures_at_its_top_level(tmp_path: Path) -> None:
    build_report(fly(tmp_path, Flight()), plot=False)
    content = json.loads((tmp_path / "report.json").read_bytes())
    assert content["passed"] is True
    assert content["schema_version"] == 1
    for name in ("target_rmse_m", "target_lost_s", "max_fence_violation_m", "min_separation_m", "landed"):
        assert content[name] is not None
    assert {criterion["name"] for criterion in content["criteria"]} >= {"target_rmse_m", "mean_cpu_cores", "landed"}


def _failed(folder: Path, flight: Flight) -> set[str]:
    report = judge(gather(fly(folder, flight)), folder)
    return {criterion.name for criterion in report.criteria if not criterion.ok}


def test_a_missing_estimate_counts_one_metre(tmp_path: Path) -> None:
    report = judge(gather(fly(tmp_path, Flight(target_missing=(15.0, 20.0)))), tmp_path)
    # The last estimate, which drifts away from the target meanwhile, still covers 0.5 s of the gap.
    assert report.figures.target_lost_s == pytest.approx(4.5, abs=0.11)
    assert report.figures.target_rmse_m == pytest.approx(math.sqrt((15.5 * 0.01 + 4.5) / 20), rel=0.05)
    assert {criterion.name for criterion in report.criteria if not criterion.ok} == {"target_rmse_m", "target_lost_s"}
    assert report.figures.target_unseen_s == pytest.approx(4.5, abs=0.11), (
        "where the truth is known it is judged by that"
    )


def test_a_tracker_that_falls_silent_counts_as_lost(tmp_path: Path) -> None:
    assert {"target_rmse_m", "target_lost_s"} <= _failed(tmp_path, Flight(estimator_stops_s=12.0))


def test_a_breached_fence_fails_by_its_distance(tmp_path: Path) -> None:
    report = judge(gather(fly(tmp_path, Flight(offset_2_m=(-1.0, 0.0, 1.7)))), tmp_path)
    assert report.figures.max_fence_violation_m == pytest.approx(0.2)
    assert not report.passed


def test_too_close_fails(tmp_path: Path) -> None:
    assert "min_separation_m" in _failed(tmp_path, Flight(offset_2_m=(-0.3, 0.0, 0.0)))


def test_still_flying_at_the_end_fails(tmp_path: Path) -> None:
    assert _failed(tmp_path, Flight(land_at_all=False)) == {"landed"}


def test_missed_deadlines_fail(tmp_path: Path) -> None:
    assert _failed(tmp_path, Flight(missed_per_s=1)) == {"tracker_missed_percent"}


def test_a_simulator_that_falls_behind_makes_the_run_invalid(tmp_path: Path) -> None:
    report = judge(gather(fly(tmp_path, Flight(sim_late_per_s=6))), tmp_path)
    assert (report.valid, report.passed) == (False, False)
    assert report.figures.sim_overrun_percent == pytest.approx(1.2)


def test_promises_of_the_command_are_judged(tmp_path: Path) -> None:
    fly(tmp_path, Flight())
    facts = RunFacts(mode="demo", seed=3, command_unix_ns=UNIX - 40 * S, tracking_s=60.0)
    run_facts.write(tmp_path, facts)
    report = judge(gather(tmp_path), tmp_path)
    assert report.figures.command_to_airborne_s == pytest.approx(42.0, abs=0.05)
    failed = {criterion.name for criterion in report.criteria if not criterion.ok}
    assert failed == {"tracked_s", "command_to_airborne_s"}


def test_nobody_is_in_the_air_before_the_command(tmp_path: Path) -> None:
    fly(tmp_path, Flight())
    run_facts.write(tmp_path, RunFacts(mode="demo", command_unix_ns=UNIX + 3600 * S))
    assert judge(gather(tmp_path), tmp_path).figures.command_to_airborne_s is None


@pytest.mark.parametrize(("before_s", "failed"), [(140, {"tracked_s"}), (160, {"tracked_s", "command_to_airborne_s"})])
def test_a_start_may_compile_once_per_version(tmp_path: Path, before_s: int, failed: set[str]) -> None:
    fly(tmp_path, Flight())
    command_ns = UNIX - before_s * S
    facts = RunFacts(mode="demo", seed=3, command_unix_ns=command_ns, tracking_s=60.0, kernels_lacked=True)
    run_facts.write(tmp_path, facts)
    report = judge(gather(tmp_path), tmp_path)
    assert {criterion.name for criterion in report.criteria if not criterion.ok} == failed


def test_a_run_in_which_nobody_flew_is_not_judged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tape = Tape(tmp_path)
    statuses(tape, Flight(), 1.0)
    tape.close()
    report = build_report(tmp_path)
    assert (report.passed, report.verdict, report.criteria, report.reasons) == (None, "not flown", (), ())
    assert report.figures.target_rmse_m is None
    page = (tmp_path / "report.html").read_text()
    assert "was not flown, as no drone took off" in page and "No drone flew: no criterion applies." in page
    assert run(["report", str(tmp_path), "--no-plot"]) == 0
    assert "NOT FLOWN, as no drone took off: nothing is judged" in capsys.readouterr().out
    assert tmp_path.name not in {one.name for one in judged_runs(tmp_path.parent)[0]}
    run_facts.write(tmp_path, RunFacts(mode="sitl", tracking_s=60.0))
    assert judge(gather(tmp_path), tmp_path).verdict == "failed", "its command asked for a flight"
    assert (tmp_path / "trajectories.png").stat().st_size > 10_000


def test_a_recording_cut_in_flight_still_reports(tmp_path: Path) -> None:
    fly(tmp_path, Flight())
    path = tmp_path / "state.mcap"
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    report = judge(gather(tmp_path), tmp_path)
    assert report.damage
    assert not report.passed


def test_a_hole_in_the_recording_of_a_flight_fails_it(tmp_path: Path) -> None:
    """A full disk: nothing is known of twelve seconds, so nothing bad is known of them either."""
    report = judge(gather(fly(tmp_path, Flight(unrecorded_s=(14.0, 26.0)))), tmp_path)
    assert report.figures.recorded_share == pytest.approx(0.4, abs=0.02)
    assert any(reason.startswith("share of the flight that is recorded 0.39") for reason in report.reasons)


def test_a_hole_before_the_flight_is_none_of_it(tmp_path: Path) -> None:
    report = judge(gather(fly(tmp_path, Flight(unrecorded_s=(5.0, 9.0)))), tmp_path)
    assert (report.figures.recorded_share, report.passed) == (1.0, True)


def test_a_part_without_a_byte_is_named_and_the_others_are_judged(tmp_path: Path) -> None:
    fly(tmp_path, Flight())
    (tmp_path / "state-2.mcap").touch()
    report = judge(gather(tmp_path), tmp_path)
    assert report.damage == ("state-2.mcap: not an MCAP recording (the file is empty)",)
    assert report.passed


def test_an_empty_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"no state\.mcap in this folder"):
        build_report(tmp_path)


def test_the_picture_is_drawn_and_the_summary_names_what_failed(tmp_path: Path) -> None:
    report = build_report(fly(tmp_path, Flight(target_missing=(15.0, 20.0))))
    assert (tmp_path / "trajectories.png").read_bytes().startswith(b"\x89PNG")
    console = Console(record=True, width=110, file=open("/dev/null", "w"))  # noqa: SIM115, PTH123
    console.print(summary(report))
    text = console.export_text()
    console.file.close()
    assert "FAILED: target error (rms) " in text
    assert "asked for at most 0.2 m; target lost 4.5 s, asked for at most 2 s" in " ".join(text.split())
    assert "battery low" in text
