"""Re-runs today's tracker in the flight loop from a journal: same inputs and ticks, plans adopted at the same ticks."""

from collections import Counter
from collections.abc import Iterable

from groundstation.bus.api import Subscription
from groundstation.bus.messages import Header, JournalEntry, Message
from groundstation.bus.sender import Sender
from groundstation.bus.topics import Topic
from groundstation.field.resolved import ResolvedField
from groundstation.planning.planner import Planner, PlanRequest
from groundstation.replay.tick_log import Tick
from groundstation.runtime.journal import STOPPED, Adoption
from groundstation.runtime.planner_watch import FailureLog
from groundstation.runtime.tracker_loop import TrackerFeed, TrackerSection, Tracking

Words = list[tuple[Topic, Message]]


class JournalBus(Sender):
    """Collects the messages that a tracker publishes in a tick; its clock is the recorded one."""

    def __init__(self, site: str, source: str, clock: str) -> None:
        super().__init__(site, source)
        self._clock = clock
        self.now_ns = 0
        self.said: Words = []

    def header(self, entity: str, stamp_ns: int | None = None) -> Header:
        """Return a header stamped with the tick's time unless another is given."""
        stamp = self.now_ns if stamp_ns is None else stamp_ns
        return Header(stamp, self._clock, entity, self.source, next(self._sequence[entity]))

    def publish(self, topic: Topic, message: Message) -> None:
        """Keep the message."""
        self.said.append((topic, message))

    def publish_bytes(self, topic: Topic, header: Header, payload: bytes) -> None:
        """Do nothing: a tracker sends no raw bytes."""

    def subscribe(
        self, topics: Iterable[Topic], entity: str = "*", source: str = "*", capacity: int = 4096, newest: bool = False
    ) -> Subscription:
        """Return a queue that stays empty."""
        return Subscription(capacity, newest)

    def close(self) -> None:
        """Do nothing: there is nothing to release."""


class JournalArrivals:
    """Returns the messages that arrived by the journal."""

    def __init__(self) -> None:
        self.refused: Counter[str] = Counter()
        self.ready: list[tuple[str, Message]] = []

    @property
    def overflowed(self) -> int:
        """Return 0: overflows are not in the journal."""
        return 0

    def pop_ready(self) -> list[tuple[str, Message]]:
        """Return and forget the messages that are ready."""
        ready, self.ready = self.ready, []
        return ready


class JournalWorker:
    """Plans at the recorded times of return, with as many evaluations as the recorded plan had.

    If settings differ and the journal has no plan for a pending request, its plan returns with the next recorded one.
    """

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self._failures = FailureLog()
        self._pending: tuple[int, PlanRequest] | None = None
        self.entry: JournalEntry | None = None

    @property
    def idle(self) -> bool:
        """Return whether no request is pending."""
        return self._pending is None

    def submit(self, tick: int, request: PlanRequest) -> None:
        """Keep a request until its plan is due."""
        self._pending = (tick, request)

    def poll(self) -> Adoption | None:
        """Return the plan that is due in this tick."""
        entry = self.entry
        if entry is None or self._pending is None or entry.plan_tick < self._pending[0]:
            return None
        (tick, request), self._pending = self._pending, None
        budget = entry.evaluations if entry.stop_reason == STOPPED else None
        try:
            plan = request.put_to(self._planner, lambda: False, budget)
        except KeyboardInterrupt:  # whoever re-runs it stops
            raise
        # As in flight (PlanWorker): a fault survived in flight can be replayed.
        except BaseException as error:  # noqa: BLE001
            return Adoption(tick, None, self._failures.take(error))
        return Adoption(tick, plan)

    def close(self) -> None:
        """Do nothing: there is nothing to stop."""


class Rerun:
    """One run of the tracker, repeated with a given field."""

    def __init__(self, field: ResolvedField, site: str, first: JournalEntry, epoch: int) -> None:
        self._arrivals = JournalArrivals()
        self._workers: list[JournalWorker] = []
        self._bus = JournalBus(site, first.header.source, first.header.clock)
        feed = TrackerFeed(self._arrivals, self._worker_of, first.header.clock, first.tick)
        self._tracking = Tracking(self._bus, TrackerSection(field, epoch), feed)

    def _worker_of(self, planner: Planner) -> JournalWorker:
        self._workers.append(JournalWorker(planner))
        return self._workers[-1]

    def tick(self, tick: Tick) -> Words:
        """Run one tick; returns its published messages, in order."""
        self._arrivals.ready = tick.inputs
        self._bus.now_ns = tick.entry.now_ns
        for worker in self._workers:
            worker.entry = tick.entry
        self._tracking.tick(tick.entry.now_ns)
        self._tracking.notices.clear()
        said, self._bus.said = self._bus.said, []
        return said
