"""Names the likely culprit when a camera's sightings re-initialise robots; said once, not each time.

A single re-initialised robot was lost. If all that one camera sees are re-initialised at once, or one robot again and
again, there is a cause that re-initialising does not mend.
"""

from collections.abc import Iterable

from groundstation.bus.messages import Severity
from groundstation.bus.notice import Notice
from groundstation.estimation.event_log import HASTY
from groundstation.estimation.measurement import Correction
from groundstation.time_units import NS_PER_S

_AT_ONCE_NS, _AGAIN_NS, _QUIET_NS = 3 * NS_PER_S, 20 * NS_PER_S, 20 * NS_PER_S
_AGAIN = 3
_CAMERA_REMEDY = "check that it was not moved and that its picture is live; land what depends on it"
_EITHER_REMEDY = "its odometry or that camera is wrong; hold or land it and look at both"


class RejoinWatch:
    """Call `take` with the corrections; robots: the names of those that fly."""

    def __init__(self, robots: Iterable[str]) -> None:
        self._robots = frozenset(robots)
        self._given_up: dict[tuple[str, str], list[int]] = {}
        self._told: dict[str, int] = {}

    def take(self, corrections: Iterable[Correction], now_ns: int) -> list[Notice]:
        """Take corrections; returns the notices for the operator."""
        found = []
        for c in corrections:
            given_up = c.joined and c.nis is not None
            if c.subject in self._robots and (given_up or c.reason == HASTY):
                times = self._given_up.setdefault((c.observer, c.subject), [])
                times[:] = [at for at in times if now_ns - at <= _AGAIN_NS] + [now_ns] * given_up
                found += self._judge(c.observer, c.subject, now_ns)
        return found

    def _judge(self, observer: str, subject: str, now_ns: int) -> list[Notice]:
        recent = {
            name
            for (by, name), times in self._given_up.items()
            if by == observer and times and now_ns - times[-1] <= _AT_ONCE_NS
        }
        lost = sorted(recent | {subject})
        if len(lost) > 1:
            text = f"{' and '.join(lost)} contradicted by {observer} at once: suspect {observer}, not them"
            return self._once(observer, text, _CAMERA_REMEDY, now_ns)
        count = len(self._given_up[observer, subject])
        if count >= _AGAIN:
            text = f"re-initialised by {observer} {count} times in {_AGAIN_NS // 10**9} s"
            return self._once(subject, text, _EITHER_REMEDY, now_ns)
        return []

    def _once(self, culprit: str, text: str, remedy: str, now_ns: int) -> list[Notice]:
        before = self._told.get(culprit)
        if before is not None and now_ns - before < _QUIET_NS:
            return []
        self._told[culprit] = now_ns
        return [Notice(Severity.WARNING, text, remedy, culprit)]
