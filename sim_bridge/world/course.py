"""Drives a target along its path: wheel speeds for each tick."""

import math
from typing import Protocol, assert_never

import numpy as np

from sim_bridge.target_paths import AlongWalls, Anywhere, FigureEight, Path, RandomWalk, Sprint, Standstill, Waypoints
from sim_bridge.world.legs import GoalCourse, Pose, corner_goals, sprint_goals, waypoint_goals
from sim_bridge.world.noise import GaussMarkov, standard_normals
from sim_bridge.world.path import EightPath

# Path follower: distance to the point of the path's tangent that it aims at; gains along it and on the heading [1/s].
_LOOK_AHEAD_M = 0.4
_ALONG, _ABOUT = 1.0, 2.5
_LARGEST_ERROR_M = 0.5
# A target that walks at random turns back to the middle of its area at this rate once it is outside.
_BACK_RAD_S = 1.2


class Course(Protocol):
    """Drives a target from its pose `start` on."""

    start: Pose

    def drive(self, x: float, y: float, yaw: float) -> tuple[float, float]:
        """Return speed [m/s] and turn rate [rad/s] for the next tick."""

    def resume(self, x: float, y: float) -> None:
        """Go on from here."""


def course_of(path: Path, tick_s: float, half_room_m: tuple[float, float], rng: np.random.Generator) -> Course | None:
    """Return the course along a path; None for a target that stands still."""
    match path:
        case Standstill() | Anywhere():
            return None
        case FigureEight():
            return EightCourse(path, tick_s)
        case RandomWalk():
            return RandomCourse(path, tick_s, rng)
        case Waypoints():
            return GoalCourse(path.points_m[0], waypoint_goals(path), tick_s)
        case Sprint():
            return GoalCourse(path.start_m, sprint_goals(path, rng), tick_s)
        case AlongWalls():
            start, goals = corner_goals(path, half_room_m)
            return GoalCourse(start, goals, tick_s)
        case other:
            assert_never(other)


class EightCourse:
    """Follows a point that runs along the figure of eight."""

    def __init__(self, figure: FigureEight, tick_s: float) -> None:
        self._path, self._tick_s = EightPath(figure), tick_s
        point = self._path.point()
        self.start = Pose(point.x, point.y, point.heading)

    def drive(self, x: float, y: float, yaw: float) -> tuple[float, float]:
        """Return speed and turn rate for the next tick."""
        path = self._path
        goal = path.point()
        dx, dy = goal.x - x, goal.y - y
        c, s = math.cos(goal.heading), math.sin(goal.heading)
        ahead, aside = c * dx + s * dy, c * dy - s * dx
        aim = goal.heading + math.atan2(aside, _LOOK_AHEAD_M)
        turn = math.remainder(aim - yaw, math.tau)
        # The running point waits for a robot that is far behind it.
        patience = max(0.0, min(1.0, 1.5 - ahead / _LARGEST_ERROR_M))
        path.advance(path.speed_m_s * self._tick_s * patience)
        ahead = max(-_LARGEST_ERROR_M, min(_LARGEST_ERROR_M, ahead))
        speed = max(0.0, path.speed_m_s * math.cos(turn) + _ALONG * ahead)
        return speed, path.speed_m_s * goal.curvature + _ABOUT * turn

    def resume(self, x: float, y: float) -> None:
        """Go on from the point of the eight that is nearest."""
        self._path.jump_to_nearest(x, y)


class RandomCourse:
    """Constant speed; the turn rate is a Gauss-Markov process; outside its area it turns back to the middle."""

    def __init__(self, walk: RandomWalk, tick_s: float, rng: np.random.Generator) -> None:
        self._walk = walk
        rate = math.radians(walk.turn_rate_std_deg_s)
        self.start = Pose(*walk.start_m, float(rng.uniform(-math.pi, math.pi)))
        self._rate = GaussMarkov(rate, walk.turn_correlation_s, tick_s, standard_normals(rng))

    def drive(self, x: float, y: float, yaw: float) -> tuple[float, float]:
        """Return speed and turn rate for the next tick."""
        walk, rate = self._walk, self._rate.step()
        (x0, x1), (y0, y1) = walk.x_m, walk.y_m
        if not (x0 <= x <= x1 and y0 <= y <= y1):
            home = math.atan2((y0 + y1) / 2 - y, (x0 + x1) / 2 - x)
            rate = max(-_BACK_RAD_S, min(_BACK_RAD_S, _ABOUT * math.remainder(home - yaw, math.tau)))
        return walk.speed_m_s, rate

    def resume(self, x: float, y: float) -> None:
        """Go on from here."""
