"""A loop with deadlines gets a higher priority where permitted; its child processes do not."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from groundstation.process.priority import LARGEST, go_first, take_share


def inherited() -> int:
    """Return the nice value of a process started now."""
    return os.getpriority(os.PRIO_PROCESS, 0)


def policies(*, heirs: bool) -> tuple[bool, int, int]:
    """A thread's result of the request, its own policy, and that of a thread that it started."""
    found: list[tuple[bool, int, int]] = []

    def ask() -> None:
        allowed, started = go_first(heirs=heirs), []
        child = threading.Thread(target=lambda: started.append(os.sched_getscheduler(0)))
        child.start()
        child.join()
        found.append((allowed, os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK, started[0]))

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    return found[0]


@pytest.mark.parametrize("heirs", [False, True])
def test_only_the_thread_that_asks_goes_first_unless_it_asks_for_its_heirs(heirs: bool) -> None:
    allowed, own, started = policies(heirs=heirs)
    assert own == (os.SCHED_RR if allowed else os.SCHED_OTHER)
    assert started == (own if heirs else os.SCHED_OTHER)


def test_where_it_may_not_it_goes_on(monkeypatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    assert go_first() is False


def nice_of(nice: int = LARGEST, *, own_session: bool, refused: bool = False) -> tuple[str, str, str]:
    """A process's result of the request, its nice value, and that of its session."""
    script = (
        "import os; from groundstation.process import priority;"
        + refused * "priority._may_have_more = lambda: False;"
        + f"print(priority.take_share({nice}), os.getpriority(os.PRIO_PROCESS, 0),"
        " open('/proc/self/autogroup').read().split()[-1])"
    )
    ran = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, start_new_session=own_session
    )
    allowed, own, session = ran.stdout.split()
    return allowed, own, session


@pytest.mark.skipif(not Path("/proc/self/autogroup").exists(), reason="this kernel has no autogroup")
def test_a_larger_share_is_the_processs_and_of_a_session_only_if_it_is_its_own() -> None:
    before = Path("/proc/self/autogroup").read_text().split()[-1]
    allowed, own, session = nice_of(own_session=True)
    assert (own, session) == (("-5", "-5") if allowed == "True" else (str(inherited()), "0"))
    assert nice_of(own_session=False)[2] == before, "others are in that session"


@pytest.mark.skipif(not Path("/proc/self/autogroup").exists(), reason="this kernel has no autogroup")
@pytest.mark.parametrize(("step", "less"), [(10, "10"), (5, "5"), (0, "0"), (-5, "0")])
def test_where_nobody_may_have_more_the_others_have_less(step: int, less: str) -> None:
    nice = LARGEST + step
    allowed, own, session = nice_of(nice, own_session=True, refused=True)
    assert (allowed, session) == ("False", less)
    assert int(own) in (int(less), max(inherited(), int(less))), "nobody gets back what he was started without"
    assert nice_of(nice, own_session=False, refused=True)[:2] == ("False", str(inherited())), (
        "others are in that session"
    )


def test_where_it_may_not_have_more_it_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "setpriority", refuse)
    assert take_share() is False
