"""Other airborne vehicles, and whether one of them is where this vehicle would climb. Pure."""

import math
from collections.abc import Iterable

from groundstation.bus.messages import AIRBORNE, UNHEARD, EntityEstimate, VehicleStatus
from groundstation.time_units import NS_PER_S

_STALE_NS = NS_PER_S
_SIGMAS = 2.0


class Neighbours:
    """The other vehicles; pad_m: place of this vehicle's climb [x, y; world]; None: unknown, then none is near."""

    def __init__(self, name: str, pad_m: tuple[float, float] | None, separation_m: float) -> None:
        self._name, self._pad_m, self._separation_m = name, pad_m, separation_m
        self._aloft: set[str] = set()
        self._believed: dict[str, tuple[int, EntityEstimate]] = {}

    def hear(self, status: VehicleStatus) -> None:
        """Take the status of any vehicle; one that flew and is lost counts as flying."""
        name, state = status.header.entity, status.flight_state
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
            distance_m = math.dist(entity.mean[:2], self._pad_m)
            size = math.isqrt(len(entity.covariance))
            std_m = math.sqrt(max(entity.covariance[0], entity.covariance[size + 1]))
            if distance_m - _SIGMAS * std_m < self._separation_m:
                return f"{name} flies {distance_m:.1f} m from its pad, at least {self._separation_m:.1f} m needed"
        return ""
