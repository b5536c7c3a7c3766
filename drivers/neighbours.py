"""Other airborne vehicles: one of them may be where this vehicle would climb, or too near in flight. Pure."""

import math
from collections.abc import Iterable

from groundstation.bus.messages import AIRBORNE, UNHEARD, EntityEstimate, FlightState, VehicleStatus
from groundstation.time_units import NS_PER_S

_STALE_NS = NS_PER_S
_FRESH_NS = NS_PER_S * 3 // 10
_SIGMAS = 2.0
# A flying vehicle keeps away once the tracker knows of the climb, as the output limiter would have it: it comes to rest
# within its lag, and until then may still be told to fly here.
_MARGIN_M, _LAG_S, _TOLD_S = 0.15, 0.5, 0.15
# Of two that are too near the lower one lands, so that none sinks through another; of two at the same height the one
# whose name comes later. Heights are known to 0.1 m.
_AS_HIGH_M = 0.2


class Neighbours:
    """The other vehicles; pad_m: place of this vehicle's climb [x, y; world]; None: unknown, then none is near.

    max_speed_m_s: of this vehicle, taken for that of the others.
    """

    def __init__(self, name: str, pad_m: tuple[float, float] | None, separation_m: float, max_speed_m_s: float) -> None:
        self._name, self._pad_m, self._separation_m = name, pad_m, separation_m
        self._max_speed_m_s = max_speed_m_s
        self._aloft: set[str] = set()
        self._sinking: set[str] = set()
        self._steered: set[str] = set()
        self._believed: dict[str, tuple[int, EntityEstimate]] = {}

    def take(self, status: VehicleStatus) -> None:
        """Take the status of any vehicle; one that flew and is lost counts as flying."""
        name, state = status.header.entity, status.flight_state
        if state is FlightState.LANDING or status.mode == "LANDING":
            self._sinking.add(name)
        else:
            self._sinking.discard(name)
        (self._steered.add if status.mode == "TRACK" else self._steered.discard)(name)
        if state in AIRBORNE:
            self._aloft.add(name)
        elif state not in UNHEARD:
            self._aloft.discard(name)

    def see(self, now_ns: int, entities: Iterable[EntityEstimate]) -> None:
        """Take the tracker's estimates of all entities."""
        self._believed |= {entity.name: (now_ns, entity) for entity in entities}

    def obstacle(self, now_ns: int) -> str:
        """Return why a take-off would be too near to an airborne vehicle, or ""."""
        if self._pad_m is None:
            return ""
        for name in sorted(self._aloft - {self._name}):
            heard_ns, entity = self._believed.get(name, (0, None))
            if entity is None or now_ns - heard_ns > _STALE_NS:
                return f"{name} is in the air, and nobody knows where"
            distance_m, least_m = math.dist(entity.mean[:2], self._pad_m), self._least_m(entity, self._pad_m)
            if distance_m - _SIGMAS * math.sqrt(_variance(entity)) < least_m:
                return f"{name} flies {distance_m:.1f} m from its pad, at least {least_m:.1f} m needed"
        return ""

    def _least_m(self, other: EntityEstimate, pad_m: tuple[float, float]) -> float:
        """Return the distance from the pad at which another can still keep away from the climb."""
        (x, y), (vx, vy) = other.mean[:2], other.velocity_m_s[:2]
        dx, dy = pad_m[0] - x, pad_m[1] - y
        nearing_m_s = max(0.0, vx * dx + vy * dy) / max(math.hypot(dx, dy), 1e-6)
        steered_m = _MARGIN_M + _TOLD_S * self._max_speed_m_s if other.name in self._steered else 0.0
        return self._separation_m + _LAG_S * nearing_m_s + steered_m

    def crowded(self, now_ns: int) -> str:
        """Return why this flying vehicle should make way for another, both of which are surely too near, or ""."""
        own = self._fresh(self._name, now_ns)
        if own is None:
            return ""
        for name in sorted(self._aloft - self._sinking - {self._name}):
            other = self._fresh(name, now_ns)
            if other is None or not self._gives_way(own, other):
                continue
            distance_m = math.dist(own.mean[:3], other.mean[:3])
            if distance_m + _SIGMAS * math.sqrt(_variance(own) + _variance(other)) < self._separation_m:
                return f"{name} flies {distance_m:.2f} m from it, at least {self._separation_m:g} m is allowed"
        return ""

    def _fresh(self, name: str, now_ns: int) -> EntityEstimate | None:
        heard_ns, entity = self._believed.get(name, (0, None))
        return entity if entity is not None and entity.converged and now_ns - heard_ns <= _FRESH_NS else None

    def _gives_way(self, own: EntityEstimate, other: EntityEstimate) -> bool:
        below_m = other.mean[2] - own.mean[2]
        return own.name > other.name if abs(below_m) <= _AS_HIGH_M else below_m > 0.0


def _variance(entity: EntityEstimate) -> float:
    """Return the variance of a place along the worse of x and y [m^2]."""
    return max(entity.covariance[0], entity.covariance[math.isqrt(len(entity.covariance)) + 1])
