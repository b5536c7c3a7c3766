"""Reports entities that join the belief or are re-initialised in it; a repeated one is unsettled. Pure."""

import math
from collections.abc import Iterable

from groundstation.bus.messages import Severity
from groundstation.bus.notice import Notice
from groundstation.estimation.measurement import Correction
from groundstation.time_units import NS_PER_S

# Two re-initialisations within this time: a source of the belief is wrong, and remains so.
_AGAIN_NS = 5 * NS_PER_S
# Without another one for this time, the entity is settled.
_SETTLED_NS = 3 * NS_PER_S


class Joinings:
    """Use: call `take` with the corrections once a tick; ask `is_unsettled`."""

    def __init__(self) -> None:
        self._last_ns: dict[str, int] = {}
        self._unsettled_ns: dict[str, int] = {}
        self._now_ns = 0

    def take(
        self, now_ns: int, corrections: Iterable[Correction], ranged: Iterable[tuple[str, str, bool]] = ()
    ) -> list[Notice]:
        """Return the notices for the operator; ranged: (observer, subject, whether again) of joinings by ranges."""
        self._now_ns = now_ns
        seen = ((one.observer, one.subject, one.nis is not None) for one in corrections if one.joined)
        return [self._note(*one) for one in (*seen, *ranged)]

    def is_unsettled(self, name: str) -> bool:
        """Return whether an entity was re-initialised twice within 5 s, and the last time within 3 s."""
        return self._now_ns - self._unsettled_ns.get(name, -math.inf) < _SETTLED_NS

    def _note(self, observer: str, subject: str, again: bool) -> Notice:
        if not again:
            return Notice(Severity.INFO, f"{subject} localised by {observer}", entity=subject)
        if self._now_ns - self._last_ns.get(subject, -math.inf) < _AGAIN_NS:
            self._unsettled_ns[subject] = self._now_ns
        self._last_ns[subject] = self._now_ns
        return Notice(Severity.WARNING, f"{subject} re-initialised by {observer}", entity=subject)
