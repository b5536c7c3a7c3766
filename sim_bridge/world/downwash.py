"""The downwash of one drone on another."""

import math

from sim_bridge.world.airframe import Airframe

# A modest wake: momentum theory gives 7.5 m/s under an AR.Drone, and forces of several do not add linearly.
_RADIUS_M = 0.3
_REACH_M = 0.5
_DOWN_M_S2 = 1.2
_OUT_M_S2 = 0.6
_NEAR_M = 1.2


def wake_between(body: Airframe, other: Airframe) -> tuple[float, float, float] | None:
    """Return the acceleration of `other` by the downwash of `body` above it, None out of its reach."""
    dx, dy, below = other.x - body.x, other.y - body.y, body.z - other.z
    if body.on_ground or below < 0.1 or abs(dx) > _REACH_M or abs(dy) > _REACH_M:
        return None
    radius = math.hypot(dx, dy) / _RADIUS_M
    strength = math.exp(-radius * radius) * min(1.0, _NEAR_M / below)
    outward = _OUT_M_S2 * strength / _RADIUS_M
    return outward * dx, outward * dy, -_DOWN_M_S2 * strength
