"""Planners of other packages that exit, fail or hang: planning goes on where it can, and the operator reads which."""

import logging
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

import msgspec
import pytest
from installation import install
from tracker_lab import Lab

from groundstation.field.resolved import ResolvedField
from groundstation.planning.planner import Planner, PlanRequest
from groundstation.runtime.journal import Adoption
from groundstation.runtime.plan_worker import PlanWorker
from groundstation.runtime.planner_watch import FailureLog, PlannerWatch

TICK_NS = 20_000_000
CODE = """
from groundstation.planning.planner import Planner


class Moody(Planner):
    mood = staticmethod(lambda: None)

    def plan(self, *asked, **more):
        self.mood()
        return super().plan(*asked, **more)
"""


class Unspeakable(Exception):
    def __str__(self) -> str:
        raise RuntimeError


@pytest.fixture
def lab(lab_field: ResolvedField, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Lab]:
    (tmp_path / "moody_planner.py").write_text(CODE)
    install(tmp_path, "moods", "[skein.planners]\nmoody = moody_planner:Moody\n")
    monkeypatch.syspath_prepend(tmp_path)
    planner = msgspec.structs.replace(lab_field.planner, plug_in="moody")
    lab = Lab(msgspec.structs.replace(lab_field, planner=planner))
    yield lab
    lab.tracking.close()
    sys.modules.pop("moody_planner", None)


def turns(lab: Lab, mood: Callable[[], Any]) -> None:
    cast(Any, lab.tracking.tracker.planner).mood = mood
    lab.tracking.notices.clear()


def told(lab: Lab) -> list[str]:
    return [notice.text for notice in lab.tracking.notices if "planner" in notice.text]


def fastest_m_s(lab: Lab) -> float:
    return max(abs(v) for setpoint in lab.messages()["setpoint"] for v in setpoint.velocity_m_s)


def failing(error: BaseException) -> Callable[[], None]:
    def fail() -> None:
        raise error

    return fail


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (SystemExit(), "SystemExit"),
        (KeyboardInterrupt(), "KeyboardInterrupt"),
        (RuntimeError("no\nroute"), "RuntimeError: no route"),
        (Unspeakable(), f"{__name__}.Unspeakable: <exception str() failed>"),
    ],
)
def test_planning_goes_on_after_a_planner_that_fails_in_any_way(error: BaseException, reason: str) -> None:
    class Failing:
        def plan(self, *_: Any) -> None:
            raise error

    worker = PlanWorker(cast(Planner, Failing()), 0.04)
    for tick in range(2):
        worker.submit(tick, PlanRequest(cast(Any, None), cast(Any, None), {}))
        until = time.monotonic() + 5.0
        while (done := worker.poll()) is None and time.monotonic() < until:
            time.sleep(0.01)
        assert done == Adoption(tick, None, reason) and worker.idle
    worker.close()


def test_a_failing_planner_is_told_by_name_and_reason_and_logged_once(
    lab: Lab, caplog: pytest.LogCaptureFixture
) -> None:
    lab.run(60, pause_s=0.002)
    turns(lab, failing(RuntimeError("no route")))
    with caplog.at_level(logging.ERROR, "groundstation.runtime.planner_watch"):
        lab.run(200, pause_s=0.002)
    assert told(lab) == ["planner moody (moods) failed: RuntimeError: no route"]
    assert len([one for one in caplog.records if one.exc_info]) == 1
    turns(lab, failing(SystemExit("no licence")))
    lab.run(20, pause_s=0.002)
    assert told(lab)[-1] == "planner moody (moods) failed: SystemExit: no licence"
    turns(lab, lambda: None)
    lab.run(60, pause_s=0.002)
    lab.messages()
    lab.run(20, pause_s=0.002)
    assert lab.messages()["plan"], "it plans again"


def test_a_planner_that_hangs_is_told_by_name_and_drones_that_track_hover(lab: Lab) -> None:
    lab.run(60, pause_s=0.002)
    assert fastest_m_s(lab) > 0.05
    released = threading.Event()
    turns(lab, released.wait)
    lab.run(95, pause_s=0.002)
    assert told(lab) == []
    lab.run(100)
    lab.messages()
    lab.run(150)
    assert told(lab) == ["planner moody (moods) does not answer"]
    texts = {notice.text for notice in lab.tracking.notices}
    assert "no new plan for 1 s: drones that track hover" in texts
    assert fastest_m_s(lab) < 0.02
    turns(lab, lambda: None)
    released.set()
    lab.run(20, pause_s=0.005)
    assert lab.messages()["plan"], "it plans again"


def test_a_planner_that_hangs_is_told_as_long_as_it_does() -> None:
    watch = PlannerWatch("", 1.0)
    texts = [n.text for tick in range(600) for n in watch.take(tick * TICK_NS, None, idle=False)]
    assert texts == 2 * ["the planner does not answer"]
    assert watch.take(600 * TICK_NS, None, idle=True) == []


def test_reasons_that_hold_figures_flood_neither_operator_nor_log(caplog: pytest.LogCaptureFixture) -> None:
    watch, log = PlannerWatch("", 1.0), FailureLog()
    failures = [log.take(ValueError(f"step {n} {'x' * 1000}")) for n in range(100)]
    assert max(map(len, failures)) < 220
    assert len(caplog.records) == 20
    adoptions = [Adoption(tick, None, failure) for tick, failure in enumerate(failures)]
    assert sum(len(watch.take(5 * one.tick * TICK_NS, one, idle=True)) for one in adoptions) == 6
