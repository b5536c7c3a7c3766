"""Finds when a wrong value became observable: the first report that clearly differs from the correct one."""

import math
from collections.abc import Iterable

from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.world.readings import Readings
from sim_bridge.wrong_values import WRONG_VALUES, WrongValues

_VELOCITY_M_S, _HEIGHT_M, _HEADING_RAD = 0.15, 0.15, math.radians(8.0)
# Repeated contents are observable at once: noise never repeats.
_AT_ONCE = frozenset({FaultKind.TELEMETRY_FROZEN})


class ObservedValues(WrongValues):
    """Wrong values of one vehicle; notes when they differ from the correct ones by more than noise explains."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        kept = tuple(faults)
        super().__init__(kept)
        self._shown_s: dict[Fault, float] = {}
        self._own = tuple(fault for fault in kept if fault.kind in WRONG_VALUES - _AT_ONCE)

    def report(self, now_s: float, honest: Readings) -> Readings:
        """Return the readings to report, as WrongValues does."""
        reported = super().report(now_s, honest)
        waiting = [fault for fault in self._own if fault not in self._shown_s and fault.covers(now_s)]
        if waiting and _differs(honest, reported):
            self._shown_s |= dict.fromkeys(waiting, now_s)
        return reported

    def observable_s(self, fault: Fault) -> float | None:
        """Return the time from which a fault shows in the reports [s]; None if it never did."""
        return self._shown_s.get(fault) if fault in self._own else fault.start_s


def _differs(honest: Readings, reported: Readings) -> bool:
    off = math.dist(honest.velocity[:2], reported.velocity[:2])
    turned = abs(math.remainder(honest.yaw - reported.yaw, math.tau))
    return off > _VELOCITY_M_S or abs(honest.height - reported.height) > _HEIGHT_M or turned > _HEADING_RAD
