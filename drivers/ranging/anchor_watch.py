"""Finds anchors that hold their last range to a robot while its others change. Pure."""

from collections.abc import Mapping
from dataclasses import dataclass

# Ranges in coarse steps to a robot that stands repeat by chance, and so do those to the other anchors meanwhile: a run
# is believed down to this chance. So many repeats are needed, however fine the steps are. Where the others repeat more
# often than this, noise is smaller than the steps: a range in the middle of a step then never changes.
_CHANCE, _LEAST, _OFTEN = 1e-9, 9, 0.4


@dataclass(slots=True)
class _Anchor:
    """The last range of an anchor, how often it repeated in a row, and how many of the others' did meanwhile."""

    last_m: float
    repeats: int = 0
    others: int = 0
    others_repeated: int = 0

    @property
    def holds(self) -> bool:
        share = (self.others_repeated + 1) / (self.others + 1)
        return self.repeats >= _LEAST and share < _OFTEN and share**self.repeats < _CHANCE


class AnchorWatch:
    """Follows the ranges of all robots; `stuck` names the anchors that hold theirs, by robot."""

    def __init__(self) -> None:
        self.stuck: dict[str, tuple[str, ...]] = {}
        self._robots: dict[str, dict[str, _Anchor]] = {}

    def sound(self, robot: str, ranges_m: Mapping[str, float]) -> dict[str, float]:
        """Return a round's ranges without those of anchors that hold theirs."""
        known = self._robots.setdefault(robot, {})
        same = {anchor: m == known[anchor].last_m for anchor, m in ranges_m.items() if anchor in known}
        repeated = sum(same.values())
        for anchor, m in ranges_m.items():
            if same.get(anchor):
                one = known[anchor]
                one.repeats += 1
                one.others += len(same) - 1
                one.others_repeated += repeated - 1
            else:
                known[anchor] = _Anchor(m)
        self.stuck[robot] = tuple(sorted(anchor for anchor, one in known.items() if one.holds))
        return {anchor: m for anchor, m in ranges_m.items() if anchor not in self.stuck[robot]}
