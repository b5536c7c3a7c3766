"""The time for which each sensing topology was flown."""

from collections import defaultdict
from itertools import pairwise

from groundstation.report.tracks import RunData

# A plan is in force until the next one, but not for longer than this: then the planner was silent.
_HOLDS_S = 0.5
_GAP_S = 0.05  # segments nearer than this are one
FLAT, STRING, OTHER, NONE = "flat", "string", "other", "(none)"


def kind_of(text: str) -> str:
    """Return flat (one level), string (one robot per level) or other; one robot alone is neither."""
    levels = [level.split(",") for level in text.split("/") if level]
    robots = sum(len(level) for level in levels)
    if robots < 2:
        return OTHER
    if len(levels) == 1:
        return FLAT
    return STRING if len(levels) == robots else OTHER


def segments(data: RunData, start_s: float, end_s: float) -> list[tuple[float, float, str]]:
    """Return (from, to, text form) of each plan in force within the interval, clipped to it."""
    found = []
    ends = [plan.time_s for plan in data.plans[1:]] + [end_s]
    for plan, next_s in zip(data.plans, ends, strict=False):
        begin, finish = max(plan.time_s, start_s), min(next_s, plan.time_s + _HOLDS_S, end_s)
        if finish > begin:
            found.append((begin, finish, plan.message.topology))
    return found


def merged(parts: list[tuple[float, float, str]]) -> list[tuple[float, float, str]]:
    """Return segments with neighbours of the same topology joined."""
    joined: list[tuple[float, float, str]] = []
    for begin, finish, text in parts:
        if joined and joined[-1][2] == text and begin - joined[-1][1] < _GAP_S:
            joined[-1] = (joined[-1][0], finish, text)
        else:
            joined.append((begin, finish, text))
    return joined


def topology_seconds(data: RunData, start_s: float, end_s: float) -> dict[str, float]:
    """Return seconds by kind and by text form."""
    seconds: defaultdict[str, float] = defaultdict(float, {FLAT: 0.0, STRING: 0.0, OTHER: 0.0})
    for begin, finish, text in segments(data, start_s, end_s):
        seconds[kind_of(text)] += finish - begin
        seconds[text or NONE] += finish - begin
    return {name: round(value, 3) for name, value in seconds.items()}


def switches(data: RunData, start_s: float, end_s: float) -> int:
    """Return the number of changes of the same robots' topology; a robot that comes or goes is no switch."""
    texts = [text for _, _, text in segments(data, start_s, end_s)]
    return sum(before != after and _robots(before) == _robots(after) for before, after in pairwise(texts))


def _robots(text: str) -> frozenset[str]:
    return frozenset(text.replace("/", ",").split(","))
