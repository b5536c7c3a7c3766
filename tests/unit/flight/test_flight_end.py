"""A run announces its end, and the reason, on the bus before its processes are stopped."""

import stat
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.errors import GroundStationError, OperatorMistake
from groundstation.flight.flight_plan import FlightPlan
from groundstation.flight.loop import Flight
from groundstation.flight.run_folder import make_run_dir
from groundstation.runtime.take_off import TakeOffLimits
from groundstation.supervisor.managed_process import ManagedProcess
from groundstation.supervisor.start import Interrupted, Start
from groundstation.supervisor.supervisor import Supervisor
from groundstation.supervisor.terminal import Terminal


class Stage:
    """A flight's view of a supervisor: one drone with telemetry, and a cause that stops the run."""

    def __init__(
        self, state: m.FlightState | None, failure: str = "", start: Exception | None = None, mode: str = "HOVER"
    ) -> None:
        exchange = MemoryExchange()
        self.bus, self._drone = MemoryBus(exchange, "lab", "supervisor"), MemoryBus(exchange, "lab", "drone_1")
        self.heard = self._drone.subscribe([t.EVENT])
        self.run = SimpleNamespace(drones=("drone_1",))
        self.interrupts = SimpleNamespace(stop_requested=not failure, hurry=False)
        self.failure, self._state, self._start, self._mode = failure, state, start, mode
        self.unwell: list[str] = []
        self.processes: tuple[ManagedProcess, ...] = ()
        self.ends: list[m.Event] = []

    def start(self) -> None:
        if self._start is not None:
            raise self._start

    def step(self) -> None:
        time.sleep(0.01)
        if self._state is None:  # its driver has not come so far
            return
        status = m.VehicleStatus(header=self._drone.header("drone_1"), flight_state=self._state, mode=self._mode)
        self._drone.publish(t.VEHICLE_STATUS, status)

    def end_run(self) -> None:
        self.ends = [r.message for r in self.heard.drain() if isinstance(r.message, m.Event)]

    def fly(self) -> m.Event:
        terminal = cast(Terminal, SimpleNamespace(say=lambda _: None, unmute=lambda: None))
        plan = FlightPlan(None, asks=False, cameras={}, limits=TakeOffLimits(unseen_s=10.0), landing_limit_s=0.1)
        try:
            flight = Flight(cast(Supervisor, self), plan, terminal)
            flight._start = cast(Start, SimpleNamespace(run=self.start, show_screen=lambda: None))
            flight.run()
        except GroundStationError:
            assert self._start is not None
        (end,) = [event for event in self.ends if event.header.entity == m.RUN]
        return end


LANDED, FLYING, UNKNOWN, LOST = (m.FlightState(name) for name in ("LANDED", "FLYING", "UNKNOWN", "LOST"))


@pytest.mark.parametrize(
    ("stage", "severity", "words"),
    [
        ({"state": LANDED}, "INFO", "stopped by the operator; all drones are on the ground"),
        ({"state": FLYING}, "WARNING", "stopped by the operator; not every drone reported a landing"),
        ({"state": LANDED, "failure": "it died\nlog"}, "ERROR", "it died; all drones are on the ground"),
        ({"state": LANDED, "start": Interrupted("no")}, "INFO", "stopped by the operator; all drones are on the"),
        ({"state": FLYING, "start": Interrupted("no")}, "WARNING", "stopped by the operator; not every drone reported"),
        ({"state": None, "start": Interrupted("no")}, "WARNING", "stopped by the operator; not every drone was heard"),
        ({"state": None}, "WARNING", "stopped by the operator; not every drone was heard"),
        ({"state": UNKNOWN}, "WARNING", "stopped by the operator; not every drone was heard"),
        ({"state": LOST, "mode": "LANDED"}, "INFO", "stopped by the operator; all drones are on the ground"),
        ({"state": LOST, "mode": "HOVER"}, "WARNING", "stopped by the operator; not every drone reported a landing"),
        ({"state": LANDED, "start": GroundStationError("no tracker\nlog")}, "ERROR", "its start failed: no tracker"),
    ],
)
def test_a_run_says_how_it_ended(stage: dict[str, Any], severity: str, words: str) -> None:
    end = Stage(**stage).fly()
    assert end.severity == severity
    assert end.text.startswith(f"run ended: {words}") and "\n" not in end.text


def test_the_folder_of_a_run_is_its_owners(tmp_path: Path) -> None:
    folder = make_run_dir(tmp_path / "runs", "lab")
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_runs_that_begin_in_the_same_second_have_a_folder_each(tmp_path: Path) -> None:
    with ThreadPoolExecutor(4) as pool:
        folders = list(pool.map(lambda _: make_run_dir(tmp_path, "lab"), range(24)))
    assert len(set(folders)) == 24


def test_nobody_flies_from_a_place_that_no_recording_can_name(tmp_path: Path) -> None:
    """Facts and messages travel as JSON; the start ended in a traceback there."""
    with pytest.raises(OperatorMistake, match="is no UTF-8 text: rename"):
        make_run_dir(tmp_path / "\udcff" / "runs", "lab")
    assert not list(tmp_path.iterdir())
