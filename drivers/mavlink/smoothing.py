"""Values in the plane that follow others with a time constant. Pure."""

import math

from groundstation.time_units import NS_PER_S
from groundstation.vectors import Vector2


def share_of(elapsed_ns: int, time_s: float) -> float:
    """Return the share of the way to a new value that is gone after a time, of time constant time_s."""
    return 1.0 - math.exp(-max(0, elapsed_ns) / NS_PER_S / time_s)


def towards(old: Vector2, new: Vector2, share: float) -> Vector2:
    """Return the value at a share of the way from one to another."""
    return old[0] + share * (new[0] - old[0]), old[1] + share * (new[1] - old[1])
