"""The tracker's journal: what each tick took in and which plan it adopted, and the replay that follows it."""

from collections import defaultdict, deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from groundstation.bus.messages import Header, JournalEntry, Message
from groundstation.errors import EstimatorFault
from groundstation.estimation.belief import JointBelief
from groundstation.planning.plan import PlanResult
from groundstation.tracker import PlanRequest, Tracker

FAULT = "fault"


@dataclass(frozen=True, slots=True)
class Adoption:
    """A plan that came back: the tick whose snapshot it was made on; `plan` is None when planning failed."""

    tick: int
    plan: PlanResult | None

    @property
    def evaluations(self) -> int:
        """Return how many cost evaluations it took."""
        return self.plan.solver.evaluations if self.plan else 0

    @property
    def stop_reason(self) -> str:
        """Return why the solver ended."""
        return self.plan.solver.status if self.plan else FAULT


def entry_of(
    header: Header, tick: int, now_ns: int, ingested: list[tuple[str, Message]], adopted: Adoption | None
) -> JournalEntry:
    """Return the journal entry of one tick."""
    names = tuple((key, message.header.seq) for key, message in ingested)
    if adopted is None:
        return JournalEntry(header=header, tick=tick, now_ns=now_ns, ingested=names)
    return JournalEntry(
        header=header,
        tick=tick,
        now_ns=now_ns,
        ingested=names,
        plan_tick=adopted.tick,
        evaluations=adopted.evaluations,
        stop_reason=adopted.stop_reason,
    )


def replay_journal(
    entries: Iterable[JournalEntry], messages: Iterable[tuple[str, Message]], tracker: Tracker
) -> Iterator[tuple[JournalEntry, JointBelief]]:
    """Feed recorded messages to a fresh tracker in journal order; yields each tick with its belief.

    Deterministic to the bit on the same machine and versions. Plans are made again where they were adopted, stopped
    after the same number of evaluations. A message that is missing from the recording is left out, as is one that the
    journal does not name.
    """
    recorded: defaultdict[tuple[str, int], deque[Message]] = defaultdict(deque)
    for key, message in messages:
        recorded[key, message.header.seq].append(message)
    entries = list(entries)
    planned = {entry.plan_tick for entry in entries}
    requests: dict[int, PlanRequest] = {}
    for entry in entries:
        for name in entry.ingested:
            if recorded[name]:
                tracker.ingest(name[0], recorded[name].popleft(), entry.now_ns)
        belief = tracker.advance(entry.now_ns)
        if entry.plan_tick in requests:
            _adopt_again(entry, requests.pop(entry.plan_tick), tracker)
        if entry.tick in planned:
            requests[entry.tick] = tracker.request()
        yield entry, belief


def _adopt_again(entry: JournalEntry, request: PlanRequest, tracker: Tracker) -> None:
    if entry.stop_reason == FAULT:
        return
    budget = entry.evaluations if entry.stop_reason == "stopped" else None
    try:
        plan = tracker.planner.plan(request.belief, request.topology, request.warm_start, lambda: False, budget)
    except EstimatorFault:
        return
    tracker.adopt(plan)
