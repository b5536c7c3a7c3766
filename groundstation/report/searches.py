"""Searches for a lost target: begin and end of each, and maps of the target's probable place."""

from collections.abc import Sequence
from dataclasses import dataclass

from groundstation.bus.messages import SearchMap
from groundstation.report.tracks import TimedMessage

# Maps come twice a second; after such a pause it is another search.
_PAUSE_S = 1.5
_MOST = 3


@dataclass(frozen=True, slots=True)
class Search:
    """One search: the maps at its begin, half way and at its end, fewer if it was short."""

    target: str
    begin_s: float
    end_s: float
    maps: tuple[TimedMessage[SearchMap], ...]


def searches(maps: dict[str, list[TimedMessage[SearchMap]]]) -> list[Search]:
    """Return the longest searches, three at most, in order of time; maps: of each target, by time."""
    found = [_search(target, one) for target, by_time in maps.items() for one in _spells(by_time)]
    found.sort(key=lambda search: search.begin_s - search.end_s)
    return sorted(found[:_MOST], key=lambda search: search.begin_s)


def _spells(by_time: Sequence[TimedMessage[SearchMap]]) -> list[list[TimedMessage[SearchMap]]]:
    spells: list[list[TimedMessage[SearchMap]]] = []
    for one in by_time:
        if not spells or one.time_s - spells[-1][-1].time_s > _PAUSE_S:
            spells.append([])
        spells[-1].append(one)
    return spells


def _search(target: str, spell: list[TimedMessage[SearchMap]]) -> Search:
    shown = sorted({0, len(spell) // 2, len(spell) - 1})
    return Search(target, spell[0].time_s, spell[-1].time_s, tuple(spell[index] for index in shown))
