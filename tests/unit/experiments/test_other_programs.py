"""Workers of a cluster that run another version of the program are refused."""

import json
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from groundstation.experiments import flight_batches, tasks
from groundstation.experiments.flight_batches import batches
from groundstation.experiments.runner import SweepError, run_tasks
from groundstation.experiments.tasks import Task

CLUSTER = "tcp://127.0.0.1:9"


class Client:
    """A dask client whose only worker is this process, with a program of its own."""

    def __init__(self, program: str, monkeypatch: pytest.MonkeyPatch) -> None:
        self._program, self._monkeypatch = program, monkeypatch

    def submit(self, function: Any, *arguments: Any, **_options: Any) -> Any:
        with self._monkeypatch.context() as there:
            if self._program:
                for module in (flight_batches, tasks):
                    there.setattr(module, "program_digest", lambda: self._program)
            result = function(*arguments)
        return Future(result)

    def close(self) -> None:
        """Nothing to close."""


class Future:
    """A task that this worker has finished."""

    status = "finished"

    def __init__(self, result: Any) -> None:
        self._result = result

    def result(self) -> Any:
        return self._result

    def release(self) -> None:
        """Nothing to release."""


@pytest.fixture(params=["", "of an earlier version"], ids=["same", "other"])
def program(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Let a cluster with this program on its worker answer; "": with ours."""
    module: Any = ModuleType("distributed")
    module.Client = lambda *_, **__: Client(request.param, monkeypatch)
    module.LocalCluster, module.as_completed = None, iter
    monkeypatch.setitem(sys.modules, "distributed", module)
    monkeypatch.setattr("groundstation.experiments.runner.dask_is_there", lambda: True)
    return str(request.param)


TASKS = {"flights": batches(json.dumps({"x": 1}), 1, 2, size=1)[0], "planar": Task("teams", 2, "certified", 1)}


@pytest.mark.parametrize("task", TASKS.values(), ids=TASKS)
def test_a_row_of_another_program_is_refused_and_not_kept(task: Any, program: str, tmp_path: Path) -> None:
    def execute(_task: Any) -> dict[str, Any]:
        return {"task": {}, "merits": {}, "timing": {}}

    if not program:
        assert run_tasks([task], tmp_path, CLUSTER, run=execute) == [execute(task)]
        return
    with pytest.raises(SweepError, match=f"a worker ran {task.key} as .* install this one there"):
        run_tasks([task], tmp_path, CLUSTER, run=execute)
    assert not list(tmp_path.iterdir())
