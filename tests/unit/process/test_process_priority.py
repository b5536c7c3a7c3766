"""A loop with deadlines goes first where it may; what it starts does not."""

import os
import threading

from groundstation.process.priority import go_first


def policies() -> tuple[bool, int, int]:
    """What a thread got by asking, its own policy, and that of a thread it started."""
    found: list[tuple[bool, int, int]] = []

    def ask() -> None:
        allowed, started = go_first(), []
        child = threading.Thread(target=lambda: started.append(os.sched_getscheduler(0)))
        child.start()
        child.join()
        found.append((allowed, os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK, started[0]))

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    return found[0]


def test_only_the_thread_that_asks_goes_first() -> None:
    allowed, own, started = policies()
    assert own == (os.SCHED_RR if allowed else os.SCHED_OTHER)
    assert started == os.SCHED_OTHER


def test_where_it_may_not_it_goes_on(monkeypatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    assert go_first() is False
