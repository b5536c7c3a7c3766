"""What the planner decided and why: each change of topology with its costs, and who was slowed by safety."""

from itertools import pairwise

import msgspec

from groundstation.bus.messages import Plan
from groundstation.report.tracks import RunData

_EPISODE_GAP_S = 0.5


class Switch(msgspec.Struct, frozen=True):
    """A change of topology: when, from what to what, the cost of both as weighed then [m^2], and the reason in words.

    stay_cost is None where the former topology was no alternative any more (a robot came or went).
    """

    time_s: float
    before: str
    after: str
    cost: float
    stay_cost: float | None
    reason: str


class Intervention(msgspec.Struct, frozen=True):
    """Safety changed one robot's velocity for one reason: episodes, plans concerned, the longest one, the most cut."""

    robot: str
    cause: str
    episodes: int
    plans: int
    longest_s: float
    most_cut_m_s: float | None


def switches(data: RunData) -> list[Switch]:
    """Return every change of the chosen topology in order of time."""
    return [
        _switch(now.time_s, before.message, now.message)
        for before, now in pairwise(data.plans)
        if before.message.topology != now.message.topology
    ]


def _switch(time_s: float, before: Plan, now: Plan) -> Switch:
    costs = {other.topology: other.cost for other in now.alternatives}
    stay = costs.get(before.topology)
    return Switch(time_s, before.topology, now.topology, now.cost, stay, _reason(before, now, stay))


def _robots(topology: str) -> set[str]:
    return {name for name in topology.replace("/", ",").split(",") if name}


def _reason(before: Plan, now: Plan, stay: float | None) -> str:
    came, went = _robots(now.topology) - _robots(before.topology), _robots(before.topology) - _robots(now.topology)
    if came or went:
        parts = [f"{', '.join(sorted(names))} {what}" for names, what in ((came, "joined"), (went, "left")) if names]
        return " and ".join(parts)
    if now.mode != before.mode:
        return f"mode {before.mode} to {now.mode}"
    if stay is None or stay <= 0.0:
        return "the former topology was no alternative"
    return f"expected uncertainty {100 * (1 - now.cost / stay):.0f} % lower"


def interventions(data: RunData) -> list[Intervention]:
    """Return what safety cut, by robot and cause, the most frequent first."""
    times: dict[tuple[str, str], list[float]] = {}
    cuts: dict[tuple[str, str], float] = {}
    for plan in data.plans:
        for control in plan.message.controls:
            for cause in control.limited_by:
                key = control.robot, cause
                times.setdefault(key, []).append(plan.time_s)
                if control.wanted_m_s is not None:
                    pairs = zip(control.wanted_m_s, control.velocity_m_s, strict=True)
                    cut = sum((wanted - given) ** 2 for wanted, given in pairs) ** 0.5
                    cuts[key] = max(cut, cuts.get(key, 0.0))
    found = [
        Intervention(robot, cause, *_episodes(when), most_cut_m_s=cuts.get((robot, cause)))
        for (robot, cause), when in times.items()
    ]
    return sorted(found, key=lambda item: (-item.plans, item.robot, item.cause))


def _episodes(times: list[float]) -> tuple[int, int, float]:
    """Return how many episodes (split by gaps of half a second), how many plans, and the longest episode [s]."""
    starts = [times[0]]
    longest = 0.0
    for before, now in pairwise(times):
        if now - before > _EPISODE_GAP_S:
            starts.append(now)
        longest = max(longest, now - starts[-1])
    return len(starts), len(times), longest
