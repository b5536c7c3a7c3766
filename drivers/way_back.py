"""Limits how fast and how far the tracker moves a hovering vehicle back to its place. Pure."""

import math

from groundstation.bus.messages import Vector3
from groundstation.time_units import NS_PER_S

_STILL: Vector3 = (0.0, 0.0, 0.0)

_MOST_M_S = 0.2
# Beyond a drift of 0.1 m/s, which it may counter for ever, a hovering vehicle is moved by this much.
_MOST_M, _DRIFT_M_S = 0.5, 0.1
_LONGEST_STEP_S = 0.2


class WayBack:
    """Lets through at most 0.2 m/s, and in any time t at most 0.5 m + 0.1 m/s t."""

    def __init__(self) -> None:
        self._way: Vector3 = _STILL
        self._last_ns: int | None = None

    def step(self, now_ns: int, asked: Vector3 | None) -> Vector3 | None:
        """Return the velocity to obey [m/s; forward, left, up]; None: it hovers by itself."""
        dt_s = 0.0 if self._last_ns is None else min((now_ns - self._last_ns) / NS_PER_S, _LONGEST_STEP_S)
        self._last_ns = now_ns
        size_m = math.hypot(*self._way)
        left = max(0.0, 1.0 - _DRIFT_M_S * dt_s / size_m) if size_m > 0.0 else 0.0
        self._way = _along(left, self._way)
        if asked is None or not all(map(math.isfinite, asked)):
            return None
        share = min(1.0, _MOST_M_S / max(math.hypot(*asked), _MOST_M_S))
        velocity = _along(share, asked)
        way = (
            self._way[0] + velocity[0] * dt_s,
            self._way[1] + velocity[1] * dt_s,
            self._way[2] + velocity[2] * dt_s,
        )
        if math.hypot(*way) > max(_MOST_M, math.hypot(*self._way)):
            return None
        self._way = way
        return velocity


def _along(share: float, vector: Vector3) -> Vector3:
    return share * vector[0], share * vector[1], share * vector[2]
