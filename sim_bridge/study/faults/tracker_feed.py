"""What the tracker's loop takes from its process in flight: its inbox, and the planner beside it."""

import statistics
import time
from collections import Counter
from collections.abc import Callable

from groundstation.bus.keys import Key
from groundstation.bus.messages import Message
from groundstation.errors import EstimatorFault
from groundstation.planning.planner import Planner, PlanRequest
from groundstation.runtime.inbox import TOPICS
from groundstation.runtime.journal import Adoption
from groundstation.runtime.planner_watch import FailureLog
from sim_bridge.study.faults.local_bus import LocalBus


class Arrivals:
    """The tracker's inbox: the arrived messages that it uses."""

    def __init__(self, bus: LocalBus, heeds: Callable[[Message], bool]) -> None:
        self._heeds = heeds
        self._subscription = bus.subscribe(TOPICS, capacity=8192)
        self._keys: dict[Key, str] = {}
        self.refused: Counter[str] = Counter()
        self.overflowed = 0

    def pop_ready(self) -> list[tuple[str, Message]]:
        """Return (key, message) of all that have arrived, in order."""
        keys = self._keys
        ready = []
        for received in self._subscription.drain():
            if received.message is None or not self._heeds(received.message):
                continue
            if (key := keys.get(received.key)) is None:
                key = keys[received.key] = str(received.key)
            ready.append((key, received.message))
        return ready


class InlineWorker:
    """Plans at once when a request is submitted; the plan is adopted a tick later.

    The flight's clock stands still meanwhile, so no planner is asked to stop: equal seeds give equal flights, however
    slow the computer is. foreign: another package's planner, whose exceptions are failed plans as in flight; one of our
    own that raises more than EstimatorFault is a fault of the program, and ends the flight.
    """

    def __init__(self, planner: Planner, foreign: bool = False) -> None:
        self._planner, self._foreign = planner, foreign
        self._done: Adoption | None = None
        self._log = FailureLog()
        self._took_s: list[float] = []
        self._failures: list[str] = []

    @property
    def idle(self) -> bool:
        """Return whether a request can be submitted."""
        return self._done is None

    def submit(self, tick: int, request: PlanRequest) -> None:
        """Plan."""
        began = time.perf_counter()
        try:
            self._done = Adoption(tick, request.put_to(self._planner, lambda: False))
        except (Exception, SystemExit) as error:
            if not (self._foreign or isinstance(error, EstimatorFault)):
                raise
            self._failures.append(self._log.take(error))
            self._done = Adoption(tick, None, self._failures[-1])
        self._took_s.append(time.perf_counter() - began)

    @property
    def failed(self) -> str:
        """Return how often planning failed and why at first; "" if it never did."""
        count = len(self._failures)
        return f"planning failed {count} time{'s' * (count > 1)}, first: {self._failures[0]}" if count else ""

    @property
    def median_s(self) -> float:
        """Return how long a plan took, by the wall clock."""
        return statistics.median(self._took_s) if self._took_s else 0.0

    def poll(self) -> Adoption | None:
        """Return and forget the finished plan."""
        done, self._done = self._done, None
        return done

    def close(self) -> None:
        """Nothing to stop."""
