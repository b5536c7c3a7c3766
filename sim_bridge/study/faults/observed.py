"""Finds when a wrong value became observable: the first report that clearly differs from the correct one by it."""

import math
from bisect import bisect_right
from collections.abc import Iterable

from sim_bridge.blind_flow import BlindReport
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.world.readings import Readings
from sim_bridge.wrong_values import WRONG_VALUES, WrongValues

_VELOCITY_M_S, _HEIGHT_M, _HEADING_RAD, _CHARGE = 0.15, 0.15, math.radians(8.0), 0.1
# Repeated contents are observable at once: noise never repeats.
_AT_ONCE = frozenset({FaultKind.TELEMETRY_FROZEN})
# Reports over a uniform floor vary (decision 0368). Healthy floors mislead by 0.1 m/s (scenario `flow-bias`), and
# cameras know the mean velocity of half a second to 0.12 m/s (three deviations).
_MISLED_M_S, _MISLED_S = 0.22, 0.5
# A report that changes by more within 0.1 s than the greatest tilt brakes (2.1 m/s^2) shows at once, without its noise.
_JUMP_M_S, _JUMP_S, _SMOOTH_S = 0.21, 0.1, 0.05


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
        self._apart = {fault: tuple(_difference(fault) for _ in range(4)) for fault in self._own}

    def report(self, now_s: float, honest: Readings) -> Readings:
        """Return the readings to report, as WrongValues does."""
        reported = super().report(now_s, honest)
        for fault, (without, alone) in [*self._instead.items()]:
            others, own = without.report(now_s, honest), alone.report(now_s, honest)
            if not fault.covers(now_s):
                continue
            pairs = (honest, reported), (others, reported), (honest, own), (own, reported)
            differ = [apart.see(now_s, *pair) for apart, pair in zip(self._apart[fault], pairs, strict=True)]
            wrong, missed, explains, left = differ
            # Of two faults that both explain a report, neither would be missed.
            if wrong and (missed or (explains and not left)):
                self._shown_s[fault] = now_s
                del self._instead[fault]
        return reported

    def observable_s(self, fault: Fault) -> float | None:
        """Return the time from which a fault shows in the reports [s]; None if it never did."""
        return self._shown_s.get(fault) if fault in self._own else fault.start_s


class Difference:
    """Whether two reports of one moment differ by more than noise explains."""

    def see(self, now_s: float, one: Readings, other: Readings) -> bool:
        """Return whether they do."""
        off = math.dist(one.velocity[:2], other.velocity[:2])
        return off > _VELOCITY_M_S or _others_differ(one, other)


class MisledDifference(Difference):
    """Likewise for varying reports over a uniform floor from start_s on: in a mean of half a second, or by a jump."""

    def __init__(self, start_s: float) -> None:
        self._times = [start_s]
        self._ways = [(0.0, 0.0)]  # the integral of the difference, along both axes [m]

    def see(self, now_s: float, one: Readings, other: Readings) -> bool:
        """Return whether they do."""
        (x, y), dt_s = self._ways[-1], now_s - self._times[-1]
        (forward, left), (its_forward, its_left) = one.velocity[:2], other.velocity[:2]
        self._times.append(now_s)
        self._ways.append((x + (forward - its_forward) * dt_s, y + (left - its_left) * dt_s))
        before_s = now_s - _JUMP_S
        jump = math.dist(self._mean(now_s - _SMOOTH_S, now_s), self._mean(before_s - _SMOOTH_S, before_s))
        misled = math.hypot(*self._mean(now_s - _MISLED_S, now_s))
        return jump > _JUMP_M_S or misled > _MISLED_M_S or _others_differ(one, other)

    def _mean(self, since_s: float, until_s: float) -> tuple[float, float]:
        """Return the mean difference of a span [m/s]; before the fault there was none."""
        (x0, y0), (x1, y1) = (self._ways[max(0, bisect_right(self._times, at) - 1)] for at in (since_s, until_s))
        return (x1 - x0) / (until_s - since_s), (y1 - y0) / (until_s - since_s)


def _difference(fault: Fault) -> Difference:
    varies = fault.kind is FaultKind.UNIFORM_FLOOR and round(fault.amount) != BlindReport.ZERO
    return MisledDifference(fault.start_s) if varies else Difference()


def _others_differ(one: Readings, other: Readings) -> bool:
    turned = abs(math.remainder(one.yaw - other.yaw, math.tau))
    risen, charged = abs(one.height - other.height), abs(one.battery - other.battery)
    return risen > _HEIGHT_M or turned > _HEADING_RAD or charged > _CHARGE
