"""Results of another version of the program, or of its plug-ins, are refused and not reused."""

import io
import json
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from installation import install

from groundstation.experiments import flight_batches, tasks
from groundstation.experiments.flight_batches import CampaignError, FlightBatch, batches, fly
from groundstation.experiments.runner import SweepError, run_tasks
from groundstation.experiments.tasks import Task
from groundstation.process.program_digest import program_digest
from sim_bridge.study.faults.flight_order import FlightOrder, fly_seeds

CLUSTER = "tcp://127.0.0.1:9"


class Client:
    """A dask client whose only worker is this process, with a program of its own."""

    def __init__(self, program: str, monkeypatch: pytest.MonkeyPatch) -> None:
        self._program, self._monkeypatch = program, monkeypatch

    def submit(self, function: Any, *arguments: Any, **_options: Any) -> Any:
        with self._monkeypatch.context() as there:
            if self._program:
                for module in (flight_batches, tasks):
                    there.setattr(module, "program_digest", lambda *_: self._program)
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


FIELD = {"drones": {}, "planner": {"plug_in": "calm"}, "target": {"marker": {"tags": [{"dictionary": "lab-tags"}]}}}
ORDER = json.dumps({"field": FIELD, "sections": [], "scenario": {}, "seconds": 5.0})


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Install a planner as a package and a dictionary as a module, in a folder that is returned."""
    for name, entry in (("calm", "[skein.planners]\ncalm = calm_lab.plans:Calm\n"), ("tags", "")):
        install(tmp_path, f"lab-{name}", entry or "[skein.markers]\nlab-tags = lab_tags:Tags\n")
    (tmp_path / "calm_lab").mkdir()
    for file in ("calm_lab/__init__.py", "calm_lab/plans.py", "calm_lab/costs.py", "lab_tags.py"):
        (tmp_path / file).write_text("")
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def key(order: str = ORDER) -> str:
    """Return the key that a new process gives to the flights of an order."""
    program_digest.cache_clear()
    return FlightBatch(order, (1, 2)).key


@pytest.mark.parametrize("file", ["calm_lab/costs.py", "lab_tags.py", "lab_calm-1.0.dist-info/METADATA"])
def test_flights_with_an_edited_plug_in_are_flown_anew(file: str, lab: Path) -> None:
    before, without = key(), key('{"field": {}}')
    assert key() == before
    (lab / file).write_text((lab / file).read_text().replace("Version: 1.0", "Version: 1.1") + "\n")
    assert key() != before and key('{"field": {}}') == without


@pytest.mark.parametrize("edited", [False, True])
def test_flights_of_a_program_edited_during_the_campaign_are_refused(
    edited: bool, lab: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (batch,) = batches(ORDER, 1, 2)
    assert batch.program == batch.program

    def started(_command: object, input: str, **_: Any) -> subprocess.CompletedProcess[str]:
        if edited:
            (lab / "calm_lab" / "plans.py").write_text("x = 1\n")
        own = program_digest.__wrapped__
        monkeypatch.setattr("sim_bridge.study.faults.flight_order.program_digest", own)
        monkeypatch.setattr("sys.stdin", io.StringIO(json.dumps(json.loads(input) | {"parent": None})))
        monkeypatch.setattr("sys.stdout", said := io.StringIO())
        assert fly_seeds(flown) == 0
        return subprocess.CompletedProcess((), 0, said.getvalue(), "")

    def flown(_order: FlightOrder, seed: int) -> dict[str, Any]:
        return {"seed": seed, "spent_s": {}}

    monkeypatch.setattr("groundstation.experiments.flight_batches.subprocess.run", started)
    if edited:
        with pytest.raises(CampaignError, match="the program or a plug-in has changed since this campaign"):
            fly(batch)
    else:
        assert fly(batch)["merits"]["flights"] == [{"seed": 1}, {"seed": 2}]
