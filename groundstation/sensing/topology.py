"""Sensing topologies: ordered partitions of the robots into levels, as the method's paper defines them."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

ROOT = "@root"
"""Stands for all world-fixed cameras as an observer."""

LEAF = "@leaf"
"""Stands for all targets as a subject."""


@dataclass(frozen=True, slots=True)
class Topology:
    """Levels from the top (seen by the root) to the bottom (sees the targets); disjoint, none empty.

    Text form: names of a level joined by commas, levels by slashes: `a,b/c`. No robots: the empty text.
    """

    levels: tuple[frozenset[str], ...]

    def __post_init__(self) -> None:
        names = [name for level in self.levels for name in level]
        if not all(self.levels) or len(names) != len(set(names)):
            raise ValueError("levels must not be empty, and a robot stands on exactly one of them")
        if any(not name or set(name) & set(",/@") for name in names):
            raise ValueError("names of robots must not be empty nor hold ',', '/' or '@'")

    @classmethod
    def flat(cls, names: Iterable[str]) -> "Topology":
        """Return the topology with all robots on one level."""
        level = frozenset(names)
        return cls((level,) if level else ())

    @classmethod
    def string(cls, names: Iterable[str]) -> "Topology":
        """Return the topology with one robot per level, the first name on top."""
        return cls(tuple(frozenset((name,)) for name in names))

    @classmethod
    def parse(cls, text: str) -> "Topology":
        """Return the topology of a text form; raises ValueError if it is invalid."""
        if not text:
            return cls(())
        parts = [[name.strip() for name in level.split(",")] for level in text.split("/")]
        if any(len(set(part)) != len(part) for part in parts):
            raise ValueError(f"{text!r} names a robot twice")
        return cls(tuple(frozenset(part) for part in parts))

    def __str__(self) -> str:
        return "/".join(",".join(sorted(level)) for level in self.levels)

    @property
    def robots(self) -> frozenset[str]:
        """Return the names of all robots."""
        return frozenset().union(*self.levels)

    def level_of(self, name: str) -> int:
        """Return a robot's level, 0 on top; raises KeyError for an unknown name."""
        for index, level in enumerate(self.levels):
            if name in level:
                return index
        raise KeyError(name)

    def level_by_robot(self) -> dict[str, int]:
        """Return the level of each robot, 0 on top."""
        return {name: index for index, level in enumerate(self.levels) for name in level}

    def edges(self) -> tuple[tuple[str, str], ...]:
        """Return all permitted (observer, subject) pairs, in a fixed order; `ROOT` and `LEAF` stand for the ends."""
        if not self.levels:
            return ()
        ends = ((ROOT,), *(tuple(sorted(level)) for level in self.levels), (LEAF,))
        return tuple((a, b) for upper, lower in pairwise(ends) for a in upper for b in lower)

    def neighbours(self) -> tuple["Topology", ...]:
        """Return all topologies with one robot moved one level up or down: at most 2n, no duplicates, in a fixed order.

        A move beyond the top or bottom creates a level; an emptied level disappears. A level is never inserted between
        two others.
        """
        found: dict[Topology, None] = {}
        for name in sorted(self.robots):
            for step in (-1, 1):
                found.setdefault(self._moved(name, step))
        found.pop(self, None)
        return tuple(found)

    def _moved(self, name: str, step: int) -> "Topology":
        levels = [set[str](), *(set(level) for level in self.levels), set[str]()]
        at = self.level_of(name) + 1
        levels[at].remove(name)
        levels[at + step].add(name)
        return Topology(tuple(frozenset(level) for level in levels if level))

    def reconciled(self, names: Iterable[str]) -> "Topology":
        """Return the topology for exactly these robots: missing ones removed, new ones added to the top level."""
        present = frozenset(names)
        if present == self.robots:
            return self
        levels = [level & present for level in self.levels if level & present]
        joining = present - self.robots
        if joining:
            levels[:1] = [(levels[0] if levels else frozenset()) | joining]
        return Topology(tuple(levels))
