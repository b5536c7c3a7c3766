"""The planner's decisions: each change of topology with its costs, and the robots slowed by safety limits."""

from itertools import pairwise

import msgspec

from groundstation.report.tracks import RunData
from groundstation.sensing.switches import Switch, switch_between

_EPISODE_GAP_S = 0.5


class Intervention(msgspec.Struct, frozen=True):
    """Interventions of safety in one robot's velocity for one reason: episodes, plans, longest episode, largest cut."""

    robot: str
    cause: str
    episodes: int
    plans: int
    longest_s: float
    most_cut_m_s: float | None


def switches(data: RunData) -> list[Switch]:
    """Return every change of the chosen topology in order of time."""
    changes = [switch_between(before.message, now.message, now.time_s) for before, now in pairwise(data.plans)]
    return [change for change in changes if change is not None]


def interventions(data: RunData) -> list[Intervention]:
    """Return the interventions by robot and cause, the most frequent first."""
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
    """Return the numbers of episodes (split by gaps of half a second) and of plans, and the longest episode [s]."""
    starts = [times[0]]
    longest = 0.0
    for before, now in pairwise(times):
        if now - before > _EPISODE_GAP_S:
            starts.append(now)
        longest = max(longest, now - starts[-1])
    return len(starts), len(times), longest
