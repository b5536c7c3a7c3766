"""The robots that can search: their pictures come, and their drivers obey; and the floor that these can show."""

from collections.abc import Collection, Mapping

import numpy as np

from groundstation.estimation.belief import JointBelief
from groundstation.estimation.room_map import Cells
from groundstation.time_units import NS_PER_S

# A camera that works tells something every 2 s, mostly more often. It must be faster to be trusted again than to stay
# trusted, else a slow one would be blind and see in turn.
_BLIND_NS, _SEES_NS = 3 * NS_PER_S, 2 * NS_PER_S
_AWAY_NS = 10 * NS_PER_S  # longer than failsafes and ways back take that end well


class SearchTeam:
    """Call `advance` with each belief; read `blind`, `shown`.

    floor: the cells to be searched; fixed: those that fixed cameras show; shown_from: those that each robot can show.
    blind: the robots whose pictures stay away; shown: the cells of the floor that fixed cameras show, and the robots
    that searched in the last 10 s (all, before any did).
    """

    def __init__(self, floor: Cells, fixed: Cells, shown_from: Mapping[str, Cells]) -> None:
        self._floor, self._fixed, self._shown_from = floor, fixed, shown_from
        self._told_ns: dict[str, int] = {}
        self._searched_ns: dict[str, int] = {}
        self.blind = set[str]()
        self._able: tuple[str, ...] = tuple(shown_from)
        self.shown = self._shown_by(self._able)

    def advance(self, belief: JointBelief, told: Collection[str], unsteered: Collection[str]) -> None:
        """Take the robots whose pictures or sightings came since the last call; unsteered: those that do not obey."""
        now_ns = belief.stamp_ns
        for name in self._shown_from:
            if name not in belief.layout:
                self._told_ns.pop(name, None)
                self._searched_ns.pop(name, None)
                self.blind.discard(name)
                continue
            waited_ns = now_ns - self._told_ns.setdefault(name, now_ns)
            self._searched_ns.setdefault(name, now_ns)
            if name not in told:
                if waited_ns > _BLIND_NS:
                    self.blind.add(name)
                continue
            self._told_ns[name] = now_ns
            if waited_ns <= _SEES_NS:
                self.blind.discard(name)
            if name not in unsteered:
                self._searched_ns[name] = now_ns
        able = tuple(name for name, at_ns in self._searched_ns.items() if now_ns - at_ns <= _AWAY_NS)
        # While nobody can search, what was to be searched stays as it was.
        if able and set(able) != set(self._able):
            self._able, self.shown = able, self._shown_by(able)

    def _shown_by(self, robots: Collection[str]) -> Cells:
        shown = self._fixed.copy()
        for name in robots:
            shown |= self._shown_from[name]
        return np.asarray(self._floor & shown)
