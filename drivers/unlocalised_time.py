"""Time for which a flying vehicle may have been elsewhere than estimated. Pure."""

from groundstation.bus.messages import NEVER_S, EntityEstimate
from groundstation.time_units import NS_PER_S


class UnlocalisedTime:
    """Call `hear` with each estimate of the vehicle and `of_flight` once a turn."""

    def __init__(self) -> None:
        self._aloft_ns: int | None = None
        self._localised_ns: int | None = None

    def hear(self, now_ns: int, entity: EntityEstimate) -> None:
        """Take the tracker's estimate; one never localised yet counts as unlocalised since its lift-off."""
        if entity.unlocalised_s < NEVER_S:
            self._localised_ns = now_ns - round(entity.unlocalised_s * NS_PER_S)
        else:
            self._localised_ns = now_ns if self._aloft_ns is None else self._aloft_ns

    def of_flight(self, now_ns: int, aloft: bool) -> float:
        """Return for how long it has been unlocalised [s]; 0 on the ground, and while no estimate has it."""
        if not aloft:
            self._aloft_ns = self._localised_ns = None
        elif self._aloft_ns is None:
            self._aloft_ns = now_ns
        return 0.0 if self._localised_ns is None else (now_ns - self._localised_ns) / NS_PER_S
