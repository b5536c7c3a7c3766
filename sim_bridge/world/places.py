"""Draws the places of targets that a scenario leaves to chance."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from groundstation.errors import SettingsError
from sim_bridge.target_paths import Anywhere, Path, Standstill

_TRIES = 1000


class Footprint(NamedTuple):
    """Rectangle of something that stands on the floor, along the room's axes: centre and size [m; world]."""

    x: float
    y: float
    width_m: float = 0.0
    depth_m: float = 0.0

    def distance_m(self, x: float, y: float) -> float:
        """Return the distance of a point [m]; 0 inside."""
        return math.hypot(max(0.0, abs(x - self.x) - self.width_m / 2), max(0.0, abs(y - self.y) - self.depth_m / 2))


def settled(
    path: Path, half_room_m: tuple[float, float], standing: Sequence[Footprint], rng: np.random.Generator
) -> Path:
    """Return a path, its place drawn if it is left to chance; raises SettingsError if no place is free."""
    if not isinstance(path, Anywhere):
        return path
    most = np.array(half_room_m) - path.clear_m
    for x, y in rng.uniform(-1.0, 1.0, (_TRIES, 2)) * most if (most >= 0.0).all() else ():
        if all(one.distance_m(x, y) >= path.clear_m for one in standing):
            return Standstill(position_m=(float(x), float(y)), yaw_deg=float(rng.uniform(-180.0, 180.0)))
    raise SettingsError(
        [f"scenario: a path with shape anywhere: no place is {path.clear_m:g} m clear of all around it"]
    )
