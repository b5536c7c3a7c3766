"""What the tracker's loop takes from its process in flight: its inbox, and the planner beside it."""

from collections import Counter
from collections.abc import Callable

from groundstation.bus.keys import Key
from groundstation.bus.messages import Message
from groundstation.errors import EstimatorFault
from groundstation.planning.planner import Planner, PlanRequest
from groundstation.runtime.inbox import TOPICS
from groundstation.runtime.journal import Adoption
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
    """Plans at once when a request is submitted; the plan is adopted a tick later."""

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self._done: Adoption | None = None

    @property
    def idle(self) -> bool:
        """Return whether a request can be submitted."""
        return self._done is None

    def submit(self, tick: int, request: PlanRequest) -> None:
        """Plan."""
        try:
            plan = request.put_to(self._planner, lambda: False)
        except EstimatorFault:
            self._done = Adoption(tick, None)
            return
        self._done = Adoption(tick, plan)

    def poll(self) -> Adoption | None:
        """Return and forget the finished plan."""
        done, self._done = self._done, None
        return done

    def close(self) -> None:
        """Nothing to stop."""
