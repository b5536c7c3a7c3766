"""Planning on a thread of its own, on belief snapshots, so that no tick waits for it."""

import threading
import time
from collections.abc import Callable
from dataclasses import replace

import msgspec

from groundstation.planning.planner import Planner, PlanRequest
from groundstation.planning.time_budget import TimeBudget
from groundstation.process.priority import Rank, go_first
from groundstation.runtime.journal import Adoption
from groundstation.runtime.planner_watch import FailureLog


class PlanWorker:
    """One request at a time: `submit` while `idle`, `poll` each tick for the result.

    budget_s: wall time after which the planner is asked to stop with the best plan so far.
    """

    def __init__(self, planner: Planner, budget_s: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._planner = planner
        self._budget_s = budget_s
        self._clock = clock
        self._failures = FailureLog()
        self._wake = threading.Condition()
        self._request: tuple[int, PlanRequest] | None = None
        self._done: Adoption | None = None
        self._busy = self._closed = False
        self._thread = threading.Thread(target=self._run, name="planner", daemon=True)
        self._thread.start()

    @property
    def idle(self) -> bool:
        """Return whether a request can be submitted."""
        return not self._busy

    def submit(self, tick: int, request: PlanRequest) -> None:
        """Start planning on the snapshot of a tick; only while `idle`."""
        with self._wake:
            self._request, self._busy = (tick, request), True
            self._wake.notify()

    def poll(self) -> Adoption | None:
        """Return and forget the finished plan, if there is one."""
        with self._wake:
            done, self._done = self._done, None
            if done is not None:
                self._busy = False
            return done

    def close(self) -> None:
        """Stop the thread once its present plan is done."""
        with self._wake:
            self._closed = True
            self._wake.notify()
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        go_first(Rank.PLAN)
        while True:
            with self._wake:
                while self._request is None and not self._closed:
                    self._wake.wait()
                if self._closed or self._request is None:
                    return
                (tick, request), self._request = self._request, None
            done = self._plan(tick, request)
            with self._wake:
                self._done = done

    def _plan(self, tick: int, request: PlanRequest) -> Adoption:
        began = self._clock()
        budget = TimeBudget(self._budget_s, self._clock)
        try:
            plan = request.put_to(self._planner, budget.must_stop)
        except BaseException as error:  # noqa: BLE001 - the thread's outermost loop: a planner that exits ends it silently
            return Adoption(tick, None, self._failures.take(error))
        report = msgspec.structs.replace(plan.solver, seconds=self._clock() - began)
        return Adoption(tick, replace(plan, solver=report))
