"""Planners of other packages in flights at message level: what they raise is a failed plan, as in flight."""

from typing import Any, cast
from unittest.mock import Mock

import pytest

from groundstation.errors import EstimatorFault
from groundstation.planning.planner import Planner
from sim_bridge.study.faults.tracker_feed import InlineWorker


def worker_of(foreign: bool, *answers: Any) -> tuple[InlineWorker, Mock]:
    request = Mock()
    request.put_to.side_effect = answers
    return InlineWorker(cast(Planner, Mock()), foreign), request


@pytest.mark.parametrize("error", [ZeroDivisionError("no cost"), SystemExit("no display")])
def test_a_foreign_planner_that_raises_has_failed_to_plan(error: BaseException) -> None:
    worker, request = worker_of(True, error, error, Mock())
    for tick in (3, 4):
        worker.submit(tick, request)
        adopted = worker.poll()
        assert adopted is not None and adopted.plan is None
        assert (adopted.tick, adopted.failure) == (tick, f"{type(error).__name__}: {error}")
    worker.submit(5, request)
    adopted = worker.poll()
    assert adopted is not None and adopted.plan is not None, "it goes on"
    assert worker.failed == f"planning failed 2 times, first: {type(error).__name__}: {error}"


def test_a_fault_of_our_own_planner_comes_to_light() -> None:
    worker, request = worker_of(False, EstimatorFault("singular"), ZeroDivisionError("no cost"))
    assert worker.failed == ""
    worker.submit(1, request)
    assert (adopted := worker.poll()) is not None and adopted.failure == "singular"
    with pytest.raises(ZeroDivisionError):
        worker.submit(2, request)


def test_the_time_of_plans_is_taken() -> None:
    worker, request = worker_of(False, Mock())
    assert worker.median_s == 0.0
    worker.submit(1, request)
    assert worker.median_s > 0.0
