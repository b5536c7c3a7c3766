"""Angles in (-pi, pi], counter-clockwise positive."""

import math


def wrap(angle_rad: float) -> float:
    """Return the same direction in (-pi, pi]."""
    wrapped = math.remainder(angle_rad, math.tau)
    return math.pi if wrapped == -math.pi else wrapped


def difference(to_rad: float, from_rad: float) -> float:
    """Return the signed shortest turn from one direction to another, in (-pi, pi]."""
    return wrap(to_rad - from_rad)
