"""Boxes that stand or move in the room, and hide markers."""

import math
from collections.abc import Iterable

import numpy as np

from groundstation.arrays import Array
from sim_bridge.scenario import TargetScenario
from sim_bridge.site import SimulatedObstacle
from sim_bridge.surroundings import Obstacle
from sim_bridge.target_paths import Standstill
from sim_bridge.truth import WIDTH
from sim_bridge.world.noise import generator_of
from sim_bridge.world.places import Footprint, settled
from sim_bridge.world.unicycle import BASES, Unicycle

_PARALLEL = 1e-12


class Box:
    """One obstacle; x, y of its middle are `body`'s."""

    def __init__(
        self, obstacle: Obstacle, tick_s: float, rng: np.random.Generator, half_room: tuple[float, float]
    ) -> None:
        most = BASES[obstacle.base].speed_m_s
        path = settled(obstacle.path, half_room, (), rng)
        driven = TargetScenario(path=path, base=obstacle.base, departs_after_team_s=None, max_speed_m_s=most, slip=0.0)
        self.body = Unicycle(driven, tick_s, rng, half_room)
        self.size_m = obstacle.size_m
        self.stands = isinstance(path, Standstill)

    @property
    def footprint(self) -> Footprint:
        """Return its place on the floor."""
        return Footprint(self.body.x, self.body.y, *self.size_m[:2])

    def step(self) -> None:
        """Move on by one tick."""
        self.body.step()

    def row(self) -> tuple[float, ...]:
        """Return its row of the truth board: its foot, never turned."""
        return (self.body.x, self.body.y, *(0.0,) * (WIDTH - 2))

    def hides(self, eye: Array, point: Array) -> bool:
        """Return whether it lies between two points [world]."""
        width, depth, height = self.size_m
        low = (self.body.x - width / 2, self.body.y - depth / 2, 0.0)
        high = (self.body.x + width / 2, self.body.y + depth / 2, height)
        enters, leaves = 0.0, 1.0
        for a, b, lower, upper in zip(eye.tolist(), point.tolist(), low, high, strict=True):
            way = b - a
            if abs(way) < _PARALLEL:
                if not lower <= a <= upper:
                    return False
                continue
            near, far = sorted(((lower - a) / way, (upper - a) / way))
            enters, leaves = max(enters, near), min(leaves, far)
        return enters < leaves


def all_obstacles(scenario: Iterable[Obstacle], room: Iterable[SimulatedObstacle]) -> tuple[Obstacle, ...]:
    """Return the obstacles of a scenario, then those of the field's room."""
    standing = (Obstacle(size_m=one.size_m, path=Standstill(position_m=one.centre_m)) for one in room)
    return (*scenario, *standing)


def box_names(count: int) -> tuple[str, ...]:
    """Return the names of the rows of boxes on the truth board."""
    return tuple(f"obstacle {index}" for index in range(count))


def boxes_of(
    obstacles: Iterable[Obstacle], tick_s: float, seed: int, half_room: tuple[float, float]
) -> tuple[Box, ...]:
    """Return boxes, each with a random generator of its own."""
    return tuple(
        Box(one, tick_s, generator_of(seed, f"obstacle {index}"), half_room) for index, one in enumerate(obstacles)
    )


def floor_below(x: float, y: float, z: float, tops: Iterable[tuple[float, float, float, float]]) -> float:
    """Return the height [m] of the surface under an ultrasound sensor: the highest top below it, else the floor.

    tops: x, y, radius and height of bodies and obstacles [m]; an echo within 15 degrees of straight down counts.
    """
    heard = 0.0
    for top_x, top_y, radius, height in tops:
        reach = radius + max(0.0, z - height) * math.tan(math.radians(15.0))
        if height < z and math.hypot(x - top_x, y - top_y) < reach:
            heard = max(heard, height)
    return heard
