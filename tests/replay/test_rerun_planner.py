"""A planner that crashes: the flight and its replay both continue."""

from typing import Any, cast

import pytest

from groundstation.bus.messages import Header, JournalEntry
from groundstation.errors import EstimatorFault
from groundstation.planning.planner import Planner, PlanRequest
from groundstation.replay.rerun import JournalWorker
from groundstation.runtime.journal import FAULT, Adoption


class Crashing:
    def __init__(self, error: BaseException) -> None:
        self._error = error

    def plan(self, *_: Any) -> None:
        raise self._error


FAULTS = {
    "IndexError: index 3 is out of bounds": IndexError("index 3 is out of bounds"),
    "no distribution": EstimatorFault("no distribution"),
    "SystemExit: 3": SystemExit(3),
}


@pytest.mark.parametrize(("failure", "error"), FAULTS.items())
def test_a_planner_that_crashed_in_flight_crashes_alike_in_a_replay(failure: str, error: BaseException) -> None:
    worker = JournalWorker(cast(Planner, Crashing(error)))
    worker.submit(7, PlanRequest(cast(Any, None), cast(Any, None), {}))
    header = Header(1, "here", "team", "tracker", 1)
    worker.entry = JournalEntry(header=header, tick=9, now_ns=1, ingested=(), plan_tick=7, stop_reason=FAULT)
    assert worker.poll() == Adoption(7, None, failure) and worker.idle
