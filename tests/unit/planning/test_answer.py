"""Answers of planners of other packages: one that cannot be flown ends neither the tracker nor planning."""

import math
import time
from dataclasses import replace
from typing import Any, cast

import msgspec
import numpy as np
import pytest

from groundstation.bus.messages import Alternative, Edge, SolverReport
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


def report(**figures: Any) -> SolverReport:
    return msgspec.structs.replace(RIGHT.solver, **figures)


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
    "evaluations of numpy": replace(RIGHT, solver=report(evaluations=np.int64(3))),
    "evaluations as text": replace(RIGHT, solver=report(evaluations="3")),
    "gap without a value": replace(RIGHT, solver=report(gap=math.nan)),
    "edge of numpy": replace(RIGHT, edges=(Edge("drone_1", "turtlebot", cast(Any, np.float32(1.0))),)),
    "edge without a value": replace(RIGHT, edges=(Edge("drone_1", "turtlebot", math.nan),)),
    "alternative of numpy": replace(RIGHT, alternatives=(Alternative("drone_1", cast(Any, np.float32(1.0))),)),
    "cost of numpy": replace(RIGHT, cost=np.float64(0.1)),
    "cost beyond 64 bits": replace(RIGHT, cost=10**30),
    "cost that is a truth value": replace(RIGHT, cost=True),
    "mode as a number": replace(RIGHT, mode=cast(Any, 7)),
    "time of numpy": replace(RIGHT, stamp_ns=cast(Any, np.int64(BELIEF.stamp_ns))),
    "time with a fraction": replace(RIGHT, stamp_ns=cast(Any, float(BELIEF.stamp_ns))),
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
