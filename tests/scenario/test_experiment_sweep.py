"""Sweeps on a real dask cluster on loopback with one worker killed."""

import os
import signal
from pathlib import Path

import pytest

from groundstation.cli.main import run
from groundstation.experiments.runner import SweepError, run_tasks
from groundstation.experiments.tasks import Task, execute

TASKS = [Task("teams", 4, "certified", seed, steps=30) for seed in range(1, 25)]


@pytest.mark.slow
@pytest.mark.study
@pytest.mark.filterwarnings("ignore")
def test_a_killed_worker_loses_nothing(tmp_path: Path) -> None:
    import distributed

    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, silence_logs=50
    ) as cluster:
        with distributed.Client(cluster) as client:
            workers = list(client.run(os.getpid).values())
        killed: list[int] = []

        def kill_one(done: int, _total: int) -> None:
            if done == 3:
                os.kill(workers[0], signal.SIGKILL)
                killed.append(workers[0])

        rows = run_tasks(TASKS, tmp_path, cluster.scheduler_address, tell=kill_one)
    assert killed
    assert len(list(tmp_path.glob("*.json"))) == len(TASKS)
    assert [row["merits"] for row in rows] == [execute(task)["merits"] for task in TASKS]


@pytest.mark.slow
@pytest.mark.study
@pytest.mark.filterwarnings("ignore")
def test_sweep_command_on_a_local_cluster(tmp_path: Path) -> None:
    arguments = ["experiment", "sweep", "--robots", "2,3", "--strategies", "certified", "--starts", "string"]
    arguments += ["--seeds", "2", "--workers", "2", "--no-figures", "--output", str(tmp_path)]
    assert run(arguments) == 0
    assert len(list((tmp_path / "tasks").glob("*.json"))) == 4
    first = (tmp_path / "results.csv").read_bytes()
    assert run([*arguments, "--scheduler", "none"]) == 0
    assert (tmp_path / "results.csv").read_bytes() == first


@pytest.mark.slow
@pytest.mark.study
@pytest.mark.filterwarnings("ignore")
def test_a_scheduler_that_is_not_there_is_named() -> None:
    with pytest.raises(SweepError, match="no dask scheduler answers"):
        run_tasks(TASKS[:1], None, "tcp://127.0.0.1:9")
