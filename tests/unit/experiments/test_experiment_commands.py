"""`groundstation experiment` and `bench planner`: files, JSON, mistakes, resumed sweeps."""

import json
from pathlib import Path
from typing import Any

import pytest

from groundstation.bench.planner import exponents
from groundstation.bench.planner_peer_process import PeerProcess, _measure, naive_calls
from groundstation.bench.planner_peers import naive, numpy_adjoint
from groundstation.bench.planner_peers.step import PeerStep
from groundstation.cli.main import run
from groundstation.experiments import runner
from groundstation.experiments.planar.parameters import PlanarParameters
from groundstation.experiments.planar.scenarios import bench_belief
from groundstation.experiments.runner import SweepError, read_result, result_file, run_tasks, write_atomically
from groundstation.experiments.tasks import Task, execute

ROW_KEYS = {
    "robots", "layout", "method", "cpu_ms_median", "cpu_ms_min", "cpu_ms_max", "topologies", "survivors", "evaluations",
    "matches_brute_force", "cost", "extrapolated", "peak_memory_mb", "failure", "repeats",
}  # fmt: skip
TASKS = [Task("teams", 2, strategy, seed, steps=4) for strategy in ("paper", "certified") for seed in (1, 2)]


def test_bench_json(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["bench", "planner", "--robots", "2,10,12", "--layout", "two-level,random", "--repeats", "2", "--json"]
    assert run(arguments) == 0
    result = json.loads(capsys.readouterr().out)
    assert len(result["rows"]) == 2 * 3 * 3
    assert all(row.keys() == ROW_KEYS for row in result["rows"])
    assert all(row["matches_brute_force"] for row in result["rows"])
    assert set(result["exponent"]) == {"two-level", "random"}


def test_bench_table_and_wrong_options(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["bench", "planner", "--robots", "3", "--layout", "string", "--repeats", "1"]) == 0
    assert "certified-wide" in capsys.readouterr().out
    for wrong in (["--robots", "x"], ["--robots", "0"], ["--layout", "ring"], ["--peer", "matlab"]):
        assert run(["bench", "planner", *wrong]) == 2


def test_bench_of_the_planner_that_flies(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["bench", "planner", "--model", "frustum", "--robots", "1", "--layout", "flat", "--repeats", "1"]
    assert run(arguments) == 0
    assert "running" in capsys.readouterr().out
    assert run([*arguments, "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["rows"]) == 2


def test_bench_of_the_planner_that_flies_refuses_what_it_would_leave_out(capsys: pytest.CaptureFixture[str]) -> None:
    for left_out, named in ((["--layout", "random"], "--layout"), (["--peer", "numpy"], "--peer")):
        assert run(["bench", "planner", "--model", "frustum", "--robots", "1", "--repeats", "1", *left_out]) == 2
        assert named in capsys.readouterr().err


def test_exponent_uses_measured_rows_from_ten_robots_on() -> None:
    rows = [
        {"layout": "flat", "method": "m", "robots": n, "cpu_ms_median": float(n) ** 2, "extrapolated": n > 40}
        for n in (2, 10, 20, 40, 80)
    ]
    rows[0]["cpu_ms_median"] = rows[-1]["cpu_ms_median"] = 1e9
    assert exponents(rows)["flat"]["m"] == pytest.approx(2.0)


def test_peer_in_its_own_process() -> None:
    with PeerProcess("numpy", 20.0) as peer:
        measured = peer.measure(3, "two-level", 3, PlanarParameters())
        assert measured is not None and measured.cost is not None and not measured.extrapolated
        assert peer.measure(3, "no such layout", 3, PlanarParameters()) is None
        assert "unknown layout" in peer.failure
        assert peer.measure(2, "flat", 3, PlanarParameters()) is not None


def test_a_peer_is_timed_warm_as_ours_is(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def solve(mean: Any, covariance: Any, levels: Any, parameters: Any, should_stop: Any) -> PeerStep:
        calls.append(should_stop())
        return PeerStep(levels, 1.0, 8, 4, 4)

    monkeypatch.setattr(numpy_adjoint, "solve", solve)
    measured = _measure("numpy", 2, "flat", 3, PlanarParameters(), 20.0)
    assert calls == [True, False]  # one topology untimed, then all of them
    assert measured.evaluations == 8


def test_the_work_of_the_naive_peer_is_guessed_as_it_is_counted() -> None:
    mean, covariance, level = bench_belief(2, "two-level", 3, PlanarParameters())
    levels = tuple(int(k) for k in level)
    exact = numpy_adjoint.solve(mean, covariance, levels, PlanarParameters(), lambda: True)
    counted = naive.solve(mean, covariance, levels, PlanarParameters(), lambda: True)
    assert naive_calls(2, exact.evaluations) == pytest.approx(counted.evaluations, rel=0.02)


def test_figure1_repeats_bit_for_bit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    texts = []
    for name in ("a", "b"):
        arguments = ["experiment", "figure1", "--robots", "3", "--seeds", "1", "--no-figures", "--json"]
        assert run([*arguments, "--output", str(tmp_path / name)]) == 0
        texts.append(((tmp_path / name / "results.csv").read_bytes(), (tmp_path / name / "summary.json").read_bytes()))
        assert json.loads(capsys.readouterr().out)["experiment"] == "figure1"
    assert texts[0] == texts[1]
    assert (tmp_path / "a" / "timing.json").is_file()


def test_pictures(tmp_path: Path) -> None:
    from groundstation.experiments.charts import save_sensors
    from groundstation.experiments.gallery import draw
    from groundstation.experiments.summary import summarise

    tasks = [Task("figure1", 2, "certified", 1, steps=5)]
    rows = run_tasks(tasks)
    draw(tmp_path, tasks, rows, summarise(rows))
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"errors.png", "figure1-2-topologies.png", "figure1-2-trajectories.png", "figure1-2.gif"}
    assert (tmp_path / "figure1-2.gif").read_bytes()[:4] == b"GIF8"
    assert all(path.read_bytes()[1:4] == b"PNG" for path in tmp_path.glob("*.png"))
    rows = [{"sensor": "s", "levels": text, "mean_trace_m2": k + 1.0, "wins": k == 0} for k, text in enumerate("12")]
    save_sensors(tmp_path / "sensors.png", rows)
    assert (tmp_path / "sensors.png").is_file()


def test_wrong_usage() -> None:
    for wrong in (
        ["figure1", "--strategies", "best"],
        ["teams", "--robots", "0"],
        ["teams", "--robots", "7", "--strategies", "global"],
        ["sensors", "--dropout", "0.5"],
        ["sweep", "--starts", "ring"],
    ):
        assert run(["experiment", *wrong]) == 2


def test_sweep_goes_on_where_it_was_stopped(tmp_path: Path) -> None:
    executed: list[Task] = []

    def stop_at_the_third(task: Task) -> dict[str, Any]:
        if len(executed) == 2:
            raise KeyboardInterrupt
        executed.append(task)
        return execute(task)

    with pytest.raises(KeyboardInterrupt):
        run_tasks(TASKS, tmp_path, run=stop_at_the_third)
    assert len(list(tmp_path.glob("*.json"))) == 2
    again: list[Task] = []

    def go_on(task: Task) -> dict[str, Any]:
        again.append(task)
        return execute(task)

    rows = run_tasks(TASKS, tmp_path, run=go_on)
    assert again == TASKS[2:]
    assert [row["task"]["seed"] for row in rows] == [1, 2, 1, 2]
    assert [row["merits"] for row in rows] == [execute(task)["merits"] for task in TASKS]


def test_half_written_results_are_run_again(tmp_path: Path) -> None:
    run_tasks(TASKS[:1], tmp_path)
    path = result_file(tmp_path, TASKS[0])
    path.write_text(path.read_text()[:40])
    assert read_result(path) is None
    assert run_tasks(TASKS[:1], tmp_path)[0]["merits"]["switches"] >= 0
    assert read_result(path) is not None
    write_atomically(tmp_path / "deep" / "file", "text")
    assert [p.name for p in (tmp_path / "deep").iterdir()] == ["file"]


def test_without_dask_a_sweep_runs_one_by_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(runner, "dask_is_there", lambda: False)
    arguments = ["experiment", "sweep", "--robots", "2", "--strategies", "fixed-flat", "--seeds", "1", "--no-figures"]
    assert run([*arguments, "--output", str(tmp_path)]) == 0
    captured = capsys.readouterr()
    assert "dask is not installed" in captured.err
    assert (tmp_path / "results.csv").is_file()
    assert run([*arguments, "--seeds", "2", "--output", str(tmp_path), "--scheduler", "tcp://127.0.0.1:9"]) == 4
    assert "needs dask" in capsys.readouterr().err
    with pytest.raises(SweepError):
        run_tasks(TASKS, None, "local")


def test_a_place_for_results_that_cannot_be_is_told_before_anything_is_computed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setattr("groundstation.experiments.runner.run_tasks", lambda *_: pytest.fail("computed"))
    for wrong in (["figure1"], ["scenarios", "random-walk", "--scheduler", "none"]):
        assert run(["experiment", *wrong, "--output", str(tmp_path / "file")]) == 2
        assert str(tmp_path / "file") in capsys.readouterr().err
