"""Measures, by truth alone, the way of drones that receive no command until their own link watchdogs stop them."""

import math
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from groundstation.arrays import Array


@dataclass(slots=True)
class DeafSpell:
    """One spell in which a flying drone received no command.

    speed_m_s, tilt_deg: at its begin, by the last command; fastest_m_s, flown_m: until the drone stood
    or received commands again, flown_m from its place at the begin.
    """

    drone: str
    from_s: float
    speed_m_s: float
    tilt_deg: float
    fastest_m_s: float = 0.0
    flown_m: float = 0.0


class DeafSpells:
    """Collects the spells; call `see` at an even rate."""

    def __init__(self) -> None:
        self._spells: list[DeafSpell] = []
        self._lasting: dict[str, tuple[DeafSpell, Array]] = {}

    @property
    def out_of_reach(self) -> Collection[str]:
        """Return the flying drones that receive no command: the ground cannot stop them."""
        return self._lasting.keys()

    def see(self, now_s: float, aloft: Mapping[str, Array], deaf: Collection[str]) -> None:
        """Record one moment. aloft: rows of the truth board of flying drones; deaf: drones that receive nothing."""
        self._lasting = {name: kept for name, kept in self._lasting.items() if name in deaf and name in aloft}
        for name in deaf:
            if (row := aloft.get(name)) is None:
                continue
            speed_m_s = math.hypot(row[3], row[4])
            if name not in self._lasting:
                tilt_deg = math.degrees(math.hypot(row[6], row[7]))
                spell = DeafSpell(name, round(now_s, 2), round(speed_m_s, 3), round(tilt_deg, 2))
                self._spells.append(spell)
                self._lasting[name] = spell, row[:2].copy()
            spell, began = self._lasting[name]
            spell.fastest_m_s = round(max(spell.fastest_m_s, speed_m_s), 3)
            spell.flown_m = round(max(spell.flown_m, math.dist(row[:2], began)), 3)

    def rows(self) -> list[dict[str, Any]]:
        """Return all spells."""
        return [asdict(spell) for spell in self._spells]
