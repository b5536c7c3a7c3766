"""Wrong values at a device's edge: functions of the correct readings, pure but for the flow over a uniform floor."""

import math
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import replace

from sim_bridge.blind_flow import BlindFlow
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.world.readings import Readings

# correct reading, value, direction [rad], time since the fault began [s] -> reported reading
Change = Callable[[Readings, float, float, float], Readings]


def _with_velocity(r: Readings, forward: float, left: float) -> Readings:
    return replace(r, velocity=(forward, left, r.vz))


def _along(amount: float, direction_rad: float) -> tuple[float, float]:
    return amount * math.cos(direction_rad), amount * math.sin(direction_rad)


def _off(r: Readings, amount: float, direction_rad: float) -> Readings:
    forward, left = _along(amount, direction_rad)
    return _with_velocity(r, r.vx + forward, r.vy + left)


def _turned(r: Readings, degrees: float) -> Readings:
    return replace(r, yaw=math.remainder(r.yaw + math.radians(degrees), math.tau))


def _above(r: Readings, obstacle_m: float) -> Readings:
    # On the floor, and below the ultrasound's range, there is no height to be wrong.
    height = max(0.01, r.height - obstacle_m) if r.height > 0.0 else 0.0
    return replace(r, height=height, echo=max(0.0, r.echo - obstacle_m) if height else r.echo)


CHANGES: dict[FaultKind, Change] = {
    FaultKind.VELOCITY_STUCK: lambda r, v, at, _: _with_velocity(r, *_along(v, at)),
    FaultKind.VELOCITY_SCALED: lambda r, v, _, __: _with_velocity(r, v * r.vx, v * r.vy),
    FaultKind.VELOCITY_DRIFTING: lambda r, v, at, elapsed_s: _off(r, v * elapsed_s, at),
    FaultKind.VELOCITY_JUMPING: lambda r, v, at, _: _off(r, v, at),
    FaultKind.HEADING_DRIFTING: lambda r, v, _, elapsed_s: _turned(r, v * elapsed_s),
    FaultKind.HEADING_JUMPING: lambda r, v, _, __: _turned(r, v),
    FaultKind.BATTERY_STUCK: lambda r, v, _, __: replace(r, battery=v),
    FaultKind.OBSTACLE_BELOW: lambda r, v, _, __: _above(r, v),
}
_OF_TIME = frozenset({FaultKind.TELEMETRY_FROZEN, FaultKind.TELEMETRY_DELAYED})
_OF_FLOW = frozenset({FaultKind.UNIFORM_FLOOR})
WRONG_VALUES = frozenset(CHANGES) | _OF_TIME | _OF_FLOW


class WrongValues:
    """The edge of one vehicle: correct readings in, reported ones out. Call `report` once per tick."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        self._faults = tuple(fault for fault in faults if fault.kind in WRONG_VALUES)
        delays = (f.amount for f in self._faults if f.kind is FaultKind.TELEMETRY_DELAYED)
        self._longest_s = max(delays, default=0.0)
        self._past: deque[tuple[float, Readings]] = deque()
        self._frozen: Readings | None = None
        self._flows = {fault: BlindFlow(fault) for fault in self._faults if fault.kind in _OF_FLOW}

    def __bool__(self) -> bool:
        return bool(self._faults)

    def report(self, now_s: float, honest: Readings) -> Readings:
        """Return the readings to report at a time of the world [s] in place of the correct ones."""
        active = [fault for fault in self._faults if fault.covers(now_s)]
        reported = honest
        for fault in active:
            if change := self._flows.get(fault) or CHANGES.get(fault.kind):
                elapsed_s = now_s - fault.start_s
                reported = change(reported, fault.amount, math.radians(fault.direction_deg), elapsed_s)
        return self._of_its_time(now_s, reported, active)

    def _of_its_time(self, now_s: float, reported: Readings, active: list[Fault]) -> Readings:
        self._past.append((now_s, reported))
        while len(self._past) > 1 and self._past[1][0] <= now_s - self._longest_s:
            self._past.popleft()
        for fault in active:
            if fault.kind is FaultKind.TELEMETRY_DELAYED:
                reported = self._at(now_s - fault.amount)
        if any(fault.kind is FaultKind.TELEMETRY_FROZEN for fault in active):
            self._frozen = self._frozen or reported
            return self._frozen
        self._frozen = None
        return reported

    def _at(self, time_s: float) -> Readings:
        found = self._past[0][1]
        for stamp_s, reading in self._past:
            if stamp_s > time_s:
                break
            found = reading
        return found


def wrong_values_of(faults: Iterable[Fault], name: str) -> WrongValues:
    """Return the edge of one vehicle under the faults of a scenario."""
    return WrongValues(fault for fault in faults if fault.entity == name)
