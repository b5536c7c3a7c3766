"""Whether plans come: without a new one, drones that track hover, and the operator is told. Pure."""

from groundstation.bus.messages import Severity
from groundstation.bus.notice import Notice
from groundstation.time_units import NS_PER_S

# An alarm stands for 8 s after the event that raised it.
_TOLD_AGAIN_NS = 5 * NS_PER_S


class PlanWatch:
    """Call `advance` once a tick; ask `is_stale` whether the last plan's controls are too old to be flown.

    max_age_s: the age from which they are, and for how long the first plan may take.
    """

    def __init__(self, max_age_s: float) -> None:
        self._max_age_s = max_age_s
        self._since_ns: int | None = None
        self._told_ns: int | None = None

    def advance(self, now_ns: int, stamp_ns: int | None, *, flying: bool) -> list[Notice]:
        """Take the time of the newest plan, if there is one; returns the notice for the operator."""
        if stamp_ns is not None:
            self._since_ns = stamp_ns
        elif self._since_ns is None:
            self._since_ns = now_ns
        if not flying or not self.is_stale(now_ns):
            self._told_ns = None
        elif self._told_ns is None or now_ns - self._told_ns >= _TOLD_AGAIN_NS:
            self._told_ns = now_ns
            text = f"no new plan for {self._max_age_s:g} s: drones that track hover"
            return [Notice(Severity.ERROR, text, "they go on with the next plan; land them if none comes")]
        return []

    def is_stale(self, now_ns: int) -> bool:
        """Return whether no plan is new enough."""
        return self._since_ns is not None and now_ns - self._since_ns > self._max_age_s * NS_PER_S
