"""Detects frozen sensors: values that repeat to the last bit for longer than any working sensor's do."""

from dataclasses import dataclass
from enum import Enum, auto

Values = tuple[object, ...]


class Novelty(Enum):
    """A value's novelty against earlier ones; REPEATED: the same again, but not yet for long."""

    NEW = auto()
    REPEATED = auto()
    FROZEN = auto()


@dataclass(slots=True)
class _Spell:
    values: Values
    since_ns: int
    count: int = 1


class FreezeWatch:
    """Decides for each source whether it has repeated itself at least `count` times over at least `span_s`."""

    def __init__(self, count: int, span_s: float) -> None:
        self._count, self._span_ns = count, round(span_s * 1e9)
        self._spells: dict[object, _Spell] = {}

    def judge(self, source: object, values: Values, stamp_ns: int) -> Novelty:
        """Take a source's values at a time of measurement; one spell is kept for each source."""
        spell = self._spells.get(source)
        if spell is None:
            self._spells[source] = _Spell(values, stamp_ns)
            return Novelty.NEW
        if spell.values != values:
            spell.values, spell.since_ns, spell.count = values, stamp_ns, 1
            return Novelty.NEW
        spell.count += 1
        frozen = spell.count > self._count and stamp_ns - spell.since_ns >= self._span_ns
        return Novelty.FROZEN if frozen else Novelty.REPEATED

    def is_frozen(self, source: object, values: Values, stamp_ns: int) -> bool:
        """Take a source's values likewise; returns whether it is frozen."""
        return self.judge(source, values, stamp_ns) is Novelty.FROZEN
