"""The tracker's journal: inputs and adopted plan of each tick (replayed by groundstation.replay)."""

from dataclasses import dataclass

from groundstation.bus.messages import Header, JournalEntry, Message
from groundstation.planning.planner import PlanResult

FAULT = "fault"
STOPPED = "stopped"


@dataclass(frozen=True, slots=True)
class Adoption:
    """A finished plan with the tick on whose snapshot it was made; `plan` is None if planning failed, by `failure`."""

    tick: int
    plan: PlanResult | None
    failure: str = ""

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
