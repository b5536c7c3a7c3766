"""Paths of the target as functions of time."""

import math
from collections.abc import Callable

import numpy as np

from groundstation.arrays import Array

Path = Callable[[float], Array]


def receding(start_m: float, speed_m_s: float, angle_rad: float = 0.0) -> Path:
    """Return a target that leaves the global sensor along a ray."""
    direction = np.array([math.cos(angle_rad), math.sin(angle_rad)])
    return lambda time_s: (start_m + speed_m_s * time_s) * direction


def figure_eight(radius_m: float = 0.5, speed_m_s: float = 0.3) -> Path:
    """Return two loops joined by straight lines that cross at the origin at right angles, from the origin.

    PAPER (docs/explanation/method.md 7): radius 0.5 m: 1.21 m by 0.5 m, 6.71 m long, 224 steps of 0.1 s at 0.3 m/s.
    """
    arc = 1.5 * math.pi * radius_m
    lap = 2.0 * (arc + 2.0 * radius_m)

    def position(time_s: float) -> Array:
        travelled = math.fmod(speed_m_s * time_s, lap)
        side = 1.0 if travelled < lap / 2 else -1.0
        along = travelled if side > 0 else travelled - lap / 2
        half = math.sqrt(0.5)
        if along < radius_m:
            point = (half * along, half * along)
        elif along < radius_m + arc:
            angle = 0.75 * math.pi - (along - radius_m) / radius_m
            point = (math.sqrt(2.0) * radius_m + radius_m * math.cos(angle), radius_m * math.sin(angle))
        else:
            left = 2.0 * radius_m + arc - along
            point = (half * left, -half * left)
        return np.array([side * point[0], point[1]])

    return position
