"""Tells the operator whose sightings show a robot turned that has not turned itself: only its place is used then."""

from collections.abc import Iterable

from groundstation.bus.messages import Severity
from groundstation.bus.notice import Notice
from groundstation.estimation.event_log import TURNED
from groundstation.estimation.measurement import Correction
from groundstation.time_units import NS_PER_S

# A single misread marker is no news; sightings with the right heading for this long end the warning.
_LASTS_NS, _APART_NS, _RIGHT_NS = NS_PER_S // 2, NS_PER_S, NS_PER_S
_REMEDY = (
    "check how the markers of its body are arranged (they must look different from each side), or its printed marker"
)


class TurnedWatch:
    """Call `take` with the corrections, once a tick."""

    def __init__(self) -> None:
        self._since: dict[tuple[str, str], tuple[int, int]] = {}
        self._told: set[tuple[str, str]] = set()

    def take(self, corrections: Iterable[Correction], now_ns: int) -> list[Notice]:
        """Take corrections; returns the notices for the operator."""
        found = []
        for c in corrections:
            if c.reason != TURNED:
                continue
            pair = c.observer, c.subject
            since_ns, last_ns = self._since.get(pair, (now_ns, now_ns))
            self._since[pair] = (since_ns if now_ns - last_ns <= _APART_NS else now_ns), now_ns
            if now_ns - self._since[pair][0] >= _LASTS_NS and pair not in self._told:
                self._told.add(pair)
                text = f"{c.observer} sees it turned, but it has not turned itself: only its place counts"
                found.append(Notice(Severity.WARNING, text, _REMEDY, c.subject))
        return found + self._ended(now_ns)

    def _ended(self, now_ns: int) -> list[Notice]:
        ended = sorted(pair for pair in self._told if now_ns - self._since[pair][1] > _RIGHT_NS)
        self._told.difference_update(ended)
        return [Notice(Severity.INFO, f"{by} no longer sees it turned", entity=whom) for by, whom in ended]
