"""Finds when a wrong value became observable: the first report that clearly differs from the correct one by it."""

import math
from collections.abc import Iterable

from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.world.readings import Readings
from sim_bridge.wrong_values import WRONG_VALUES, WrongValues

_VELOCITY_M_S, _HEIGHT_M, _HEADING_RAD, _CHARGE = 0.15, 0.15, math.radians(8.0), 0.1
# Repeated contents are observable at once: noise never repeats.
_AT_ONCE = frozenset({FaultKind.TELEMETRY_FROZEN})


class ObservedValues(WrongValues):
    """Wrong values of one vehicle; notes which of them makes the reports differ by more than noise explains."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        kept = tuple(faults)
        super().__init__(kept)
        self._shown_s: dict[Fault, float] = {}
        self._own = tuple(fault for fault in kept if fault.kind in WRONG_VALUES - _AT_ONCE)
        # For each fault, the vehicle without it, and the vehicle with nothing else.
        self._instead = {
            fault: (WrongValues(other for other in kept if other is not fault), WrongValues([fault]))
            for fault in self._own
        }

    def report(self, now_s: float, honest: Readings) -> Readings:
        """Return the readings to report, as WrongValues does."""
        reported = super().report(now_s, honest)
        for fault, (without, alone) in [*self._instead.items()]:
            others, own = without.report(now_s, honest), alone.report(now_s, honest)
            if not (fault.covers(now_s) and _differs(honest, reported)):
                continue
            # Of two faults that both explain a report, neither would be missed.
            if _differs(others, reported) or (_differs(honest, own) and not _differs(own, reported)):
                self._shown_s[fault] = now_s
                del self._instead[fault]
        return reported

    def observable_s(self, fault: Fault) -> float | None:
        """Return the time from which a fault shows in the reports [s]; None if it never did."""
        return self._shown_s.get(fault) if fault in self._own else fault.start_s


def _differs(one: Readings, other: Readings) -> bool:
    off = math.dist(one.velocity[:2], other.velocity[:2])
    turned = abs(math.remainder(one.yaw - other.yaw, math.tau))
    risen, charged = abs(one.height - other.height), abs(one.battery - other.battery)
    return off > _VELOCITY_M_S or risen > _HEIGHT_M or turned > _HEADING_RAD or charged > _CHARGE
