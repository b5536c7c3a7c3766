"""Answers of planners of other packages: one that cannot be flown ends neither the tracker nor planning."""

import time
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from groundstation.bus.messages import SolverReport
from groundstation.library import belief_of
from groundstation.planning.planner import Planner, PlanRequest, PlanResult
from groundstation.runtime.plan_worker import PlanWorker
from groundstation.sensing.topology import Topology

FLAT = Topology.flat(["drone_1"])
BELIEF = belief_of({"drone_1": (0.0, 0.0, 1.6, 0.0)}, {"turtlebot": (1.0, 0.0, 0.0, 0.0)})
REQUEST = PlanRequest(BELIEF, FLAT, {})
RIGHT = PlanResult(
    FLAT, 0.1, 0.1, {"drone_1": np.zeros(3)}, {"drone_1": 1.6}, (), (), SolverReport("complete", 1, 0.0, 1, 1), "mine",
    BELIEF.stamp_ns,
)  # fmt: skip
WRONG = {
    "nothing": None,
    "no height": replace(RIGHT, heights={}),
    "height without a value": replace(RIGHT, heights={"drone_1": np.nan}),
    "two controls": replace(RIGHT, controls={"drone_1": np.zeros(2)}),
    "infinite control": replace(RIGHT, controls={"drone_1": np.array([0.0, np.inf, 0.0])}),
    "topology as text": replace(RIGHT, topology=cast(Topology, "drone_1")),
    "control beside the topology": replace(RIGHT, topology=Topology(())),
    "another robot": replace(RIGHT, topology=Topology.flat(["drone_1", "drone_9"])),
    "height of another robot": replace(RIGHT, heights={"drone_1": 1.6, "drone_9": 1.6}),
    "another clock": replace(RIGHT, stamp_ns=1_700_000_000_000_000_000),
    "cost without a value": replace(RIGHT, cost=np.nan),
    "report of another kind": replace(RIGHT, solver=cast(SolverReport, "complete")),
    "edges as a list": replace(RIGHT, edges=cast(Any, [])),
}


class Answering:
    def __init__(self, answer: Any) -> None:
        self.answer = answer

    def plan(self, *_: Any) -> Any:
        return self.answer


def test_a_right_answer_is_returned_as_it_is() -> None:
    assert REQUEST.put_to(Answering(RIGHT), lambda: False) is RIGHT


@pytest.mark.parametrize("answer", WRONG.values(), ids=WRONG.keys())
def test_an_answer_that_cannot_be_flown_is_refused(answer: Any) -> None:
    with pytest.raises((TypeError, ValueError), match="a plan"):
        REQUEST.put_to(Answering(answer), lambda: False)


def test_planning_goes_on_after_a_wrong_answer() -> None:
    planner = Answering(None)
    worker = PlanWorker(cast(Planner, planner), 0.04)
    found = []
    for tick, answer in enumerate((None, WRONG["another clock"], RIGHT)):
        planner.answer = answer
        worker.submit(tick, REQUEST)
        until = time.monotonic() + 5.0
        while (done := worker.poll()) is None and time.monotonic() < until:
            time.sleep(0.01)
        assert done is not None and worker.idle
        found.append((done.tick, done.plan is not None))
    worker.close()
    assert found == [(0, False), (1, False), (2, True)]
