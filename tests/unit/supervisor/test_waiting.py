"""The time that a start waits for optional processes."""

from types import SimpleNamespace
from typing import Any

import pytest

from groundstation.process.heartbeat import SlotState
from groundstation.supervisor.waiting import Waiting

GRACE_S = 5.0


@pytest.fixture
def driver() -> Any:
    """Stand-in for a process of `Waiting`: alive, and not up yet."""
    spec = SimpleNamespace(name="ceiling", start_limit_s=60.0)
    return SimpleNamespace(spec=spec, is_up=False, begins=True, life=1, state=SlotState.EMPTY, detail="")


def given_up_at(waiting: Waiting, until_s: float) -> float | None:
    return next((k / 10 for k in range(round(10 * until_s)) if waiting.take_late(k / 10)), None)


def test_one_that_imports_slowly_is_waited_for(driver: Any) -> None:
    """A second run on a fully loaded machine: its cameras took 10 s to import and were ready 23 s after the start."""
    waiting = Waiting([driver], 0.0, GRACE_S)
    assert given_up_at(waiting, 30.0) is None
    driver.is_up, driver.state = True, SlotState.READY
    waiting.take_up()
    assert waiting.take_up() == [driver] and not waiting.processes


def test_one_that_never_begins_holds_nobody_for_ever(driver: Any) -> None:
    assert given_up_at(Waiting([driver], 0.0, GRACE_S), 60.0) == pytest.approx(40.0, abs=0.2)


def test_one_that_has_begun_or_failed_is_waited_for_a_moment(driver: Any) -> None:
    driver.begins = False
    assert given_up_at(Waiting([driver], 0.0, GRACE_S), 60.0) == pytest.approx(GRACE_S, abs=0.2)
