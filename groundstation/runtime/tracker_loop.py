"""The tracker's loop: one tick takes in new messages, advances the belief, and publishes the results."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import msgspec

from groundstation import plug_ins
from groundstation.bus import clock
from groundstation.bus.api import Bus
from groundstation.bus.messages import Message, Severity, Suspicion
from groundstation.bus.notice import Notice
from groundstation.bus.topics import SEARCH_MAP
from groundstation.field.resolved import ResolvedField
from groundstation.planning.planner import Planner, PlanRequest
from groundstation.runtime.announcer import Announcer
from groundstation.runtime.asking import TEAM
from groundstation.runtime.consistency_watch import ConsistencyWatch
from groundstation.runtime.inbox import Inbox
from groundstation.runtime.journal import Adoption, entry_of
from groundstation.runtime.latency_watch import PictureAge
from groundstation.runtime.plan_worker import PlanWorker
from groundstation.runtime.planner_watch import PlannerWatch
from groundstation.runtime.rejoin_watch import RejoinWatch
from groundstation.runtime.turned_watch import TurnedWatch
from groundstation.runtime.unseen_watch import UnseenWatch
from groundstation.tracker import Tracker, tracker_from_field

_BELIEF_HZ = 5
# Work that is not due at each tick, and the ticks in which it is done: all in one tick made that late, once a second.
# Beliefs stay in the ticks where earlier recordings have them.
_PLAN_PHASE, _BELIEF_PHASE, _MAP_PHASE, _WATCH_PHASE = 0, 0, 2, 24
_PLAN_BUDGET_SHARE = 0.4  # of the planner's period: an adopted plan is never older than one period
EPOCHS_PER_LIFE = 1000  # the tracker begins a new epoch itself when its belief breaks


class TrackerSection(msgspec.Struct, frozen=True):
    """The tracker's section: the resolved field, the life's number."""

    field: ResolvedField
    epoch: int = 0


class Arrivals(Protocol):
    """The messages that came for the tracker since the last tick (see Inbox)."""

    refused: Counter[str]

    @property
    def overflowed(self) -> int:
        """Return how many messages were dropped because the loop did not drain in time."""

    def pop_ready(self) -> list[tuple[str, Message]]:
        """Return (key, message) of all that has arrived, in order."""


class Worker(Protocol):
    """Plans on snapshots of the belief (see PlanWorker)."""

    @property
    def idle(self) -> bool:
        """Return whether a request can be submitted."""

    def submit(self, tick: int, request: PlanRequest) -> None:
        """Start planning on the snapshot of a tick; only while `idle`."""

    def poll(self) -> Adoption | None:
        """Return and forget the finished plan, if there is one."""

    def close(self) -> None:
        """Stop planning."""


@dataclass(frozen=True, slots=True)
class TrackerFeed:
    """A tracker's sources of messages, plans and time: live ones, or those of a journal."""

    arrivals: Arrivals
    worker_of: Callable[[Planner], Worker]
    clock: str
    first_tick: int = 0


def live_feed(bus: Bus, plan_hz: float) -> TrackerFeed:
    """Return the feed of a bus, with plans made on a thread of their own."""
    budget_s = _PLAN_BUDGET_SHARE / plan_hz
    return TrackerFeed(Inbox(bus), lambda planner: PlanWorker(planner, budget_s), clock.clock_id())


class Tracking:
    """One tracker on one bus. Call `tick` at the estimator's rate; notices are left in `notices` for the process."""

    def __init__(self, bus: Bus, section: TrackerSection, feed: TrackerFeed | None = None) -> None:
        field = section.field
        plan_hz = field.planner.rate_hz
        feed = feed or live_feed(bus, plan_hz)
        self.rate_hz: int = field.estimator.rate_hz
        self.tracker: Tracker = tracker_from_field(field, feed.clock, section.epoch * EPOCHS_PER_LIFE)
        if field.planner.plug_in:
            parameters = self.tracker.parameters
            self.tracker.planner = plug_ins.planner(field.planner.plug_in, parameters.planner, parameters.sensors)
        self.inbox = feed.arrivals
        self.notices: list[Notice] = []
        self._bus = bus
        self._announcer = Announcer(bus, field.safety.setpoint_lifetime_ms)
        self._contradictions = ConsistencyWatch(self.tracker.parameters.estimator.entities)
        self._rejoining, self._turned = RejoinWatch(self.tracker.robots), TurnedWatch()
        self._picture_age = PictureAge(field, feed.clock)
        self._suspected = ""
        self._planner = PlannerWatch(field.planner.plug_in, self.tracker.parameters.control.max_plan_age_s)
        self._unseen = UnseenWatch(field.safety.unseen_land_after_s)
        self._plan_every = max(1, round(self.rate_hz / plan_hz))
        self._belief_every = max(1, round(self.rate_hz / _BELIEF_HZ))
        self._map_every = max(1, round(self.rate_hz / SEARCH_MAP.rate_hz))
        self._worker = feed.worker_of(self.tracker.planner)
        self._tick = feed.first_tick
        self._known_refusals: Counter[str] = Counter()

    def tick(self, now_ns: int) -> None:
        """Do all work that is due at this time."""
        tracker, announcer = self.tracker, self._announcer
        ingested = self.inbox.pop_ready()
        for key, message in ingested:
            if isinstance(message, Suspicion):
                self._suspected = message.cause
                continue
            verdict = tracker.ingest(key, message, now_ns)
            if verdict is None:
                self._picture_age.take(message)
            else:
                self._contradictions.refused(message, verdict, now_ns)
        tracker.advance(now_ns)
        adopted = self._worker.poll()
        if adopted is not None and adopted.plan is not None:
            tracker.adopt(adopted.plan)
        if self._is_due(self._plan_every, _PLAN_PHASE) and self._worker.idle:
            self._worker.submit(self._tick, tracker.request())
        limited = tracker.setpoints(now_ns)
        announcer.setpoints(tracker, limited, now_ns)
        announcer.estimate(tracker, now_ns)
        if self._is_due(self._belief_every, _BELIEF_PHASE):
            announcer.belief(tracker, self._picture_age.lateness(), now_ns)
        if self._is_due(self._map_every, _MAP_PHASE):
            announcer.search_maps(tracker, now_ns)
        if adopted is not None and adopted.plan is not None:
            announcer.plan(adopted.plan, limited, "HOLD" if tracker.holding else adopted.plan.mode)
        corrections = tracker.take_corrections()
        announcer.innovations(corrections, now_ns)
        self._contradictions.take(corrections, now_ns)
        self.notices += self._rejoining.take(corrections, now_ns) + self._turned.take(corrections, now_ns)
        announcer.journal(entry_of(self._bus.header(TEAM, now_ns), self._tick, now_ns, ingested, adopted))
        self.notices += self._planner.take(now_ns, adopted, idle=self._worker.idle)
        self._watch(now_ns)
        self._tick += 1

    def close(self) -> None:
        """Stop planning."""
        self._worker.close()

    def _is_due(self, every: int, phase: int) -> bool:
        return self._tick % every == phase % every

    def _watch(self, now_ns: int) -> None:
        tracker = self.tracker
        self.notices += tracker.take_notices()
        for name in self._unseen.step(now_ns, tracker.unlocalised_s()):
            text = "flies, and nobody knows well enough where it is: its driver lands it"
            self.notices.append(Notice(Severity.WARNING, text, "check its camera links and its marker", name))
        if self._is_due(self.rate_hz, _WATCH_PHASE):
            self.notices += self._contradictions.notices(now_ns, self._suspected) + self._picture_age.notices()
            self._report_refusals()

    def _report_refusals(self) -> None:
        """Report once for each kind that messages are refused; their numbers are in the log of the process."""
        for reason in set(self.inbox.refused) | set(self.tracker.rejected):
            if reason not in self._known_refusals:
                self._known_refusals[reason] = 1
                self.notices.append(Notice(Severity.WARNING, f"messages are refused: {reason}"))
