"""Paths of straight legs: goals one after the other, and the course that drives to them."""

import itertools
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sim_bridge.target_paths import AlongWalls, Sprint, Waypoints

Point = tuple[float, float]
# Errors at which a target that turns on the spot points to its goal [rad], and at which it has arrived [m].
_AIM_RAD, _ARRIVED_M = 0.15, 0.06
# Gains: of the heading [1/s], and of the speed on the remaining distance [1/s].
_ABOUT, _BRAKE = 4.0, 2.0
_TURN_RAD_S = 3.0


class Pose(NamedTuple):
    """Place [m; world] and heading [rad; world]."""

    x: float
    y: float
    yaw: float


class Goal(NamedTuple):
    """Goal of a leg: place, speed, direction of travel, and time to stand there."""

    x: float
    y: float
    speed_m_s: float
    backwards: bool = False
    pause_s: float = 0.0


def waypoint_goals(path: Waypoints) -> Iterator[Goal]:
    """Yield the goals of a path from its second point on."""
    speeds = path.speeds_m_s or (path.speed_m_s,) * len(path.points_m)
    goals = [Goal(x, y, speed, pause_s=path.pause_s) for (x, y), speed in zip(path.points_m, speeds, strict=True)]
    match path.after_last:
        case "stop":
            return iter(goals[1:])
        case "first":
            return itertools.chain(goals[1:], itertools.cycle(goals))
        case _:
            return itertools.cycle([*goals[1:], *goals[-2::-1]])


def corner_goals(path: AlongWalls, half_room_m: Point) -> tuple[Point, Iterator[Goal]]:
    """Return the corner where a target along the walls starts, and its goals from then on."""
    x, y = (max(0.1, half - path.from_wall_m) for half in half_room_m)
    corners = [(x, y), (-x, y), (-x, -y), (x, -y)]
    turned = corners[path.start_corner :] + corners[: path.start_corner]
    goals = [Goal(*corner, path.speed_m_s) for corner in turned]
    return turned[0], itertools.chain(goals[1:], itertools.cycle(goals))


def sprint_goals(path: Sprint, rng: np.random.Generator) -> Iterator[Goal]:
    """Yield the ends of random legs, each within the area."""
    (x, y), heading = path.start_m, float(rng.uniform(-math.pi, math.pi))
    last: Point | None = None
    while True:
        if last is not None and rng.random() < path.reverse_share:
            (x, y), last = last, None
            yield Goal(x, y, path.speed_m_s, backwards=True, pause_s=path.pause_s)
            continue
        turn = math.radians(float(rng.uniform(*path.turn_deg))) * (1 if rng.random() < 0.5 else -1)
        length = path.speed_m_s * float(rng.uniform(*path.leg_s))
        options = [heading + turn, heading - turn, _homewards(path, x, y)]
        heading = max(options[:2], key=lambda at: _fits(path, x, y, at, length))
        if not _fits(path, x, y, heading, length):
            heading = options[2]
        last = x, y
        x, y = (_inside(x + length * math.cos(heading), path.x_m), _inside(y + length * math.sin(heading), path.y_m))
        yield Goal(x, y, path.speed_m_s, pause_s=path.pause_s)


def _homewards(path: Sprint, x: float, y: float) -> float:
    return math.atan2(sum(path.y_m) / 2 - y, sum(path.x_m) / 2 - x)


def _fits(path: Sprint, x: float, y: float, heading: float, length: float) -> bool:
    end_x, end_y = x + length * math.cos(heading), y + length * math.sin(heading)
    return path.x_m[0] <= end_x <= path.x_m[1] and path.y_m[0] <= end_y <= path.y_m[1]


def _inside(value: float, side: tuple[float, float]) -> float:
    return max(side[0], min(side[1], value))


class GoalCourse:
    """Drives to one goal after the other; stands when none is left."""

    def __init__(self, start: Point, goals: Iterator[Goal], tick_s: float) -> None:
        self._goals, self._tick_s = goals, tick_s
        self._goal = next(goals, None)
        towards = (self._goal.x, self._goal.y) if self._goal else start
        heading = math.atan2(towards[1] - start[1], towards[0] - start[0])
        self.start = Pose(*start, heading)
        self._aimed, self._wait_s = False, 0.0

    def drive(self, x: float, y: float, yaw: float) -> tuple[float, float]:
        """Return speed [m/s] and turn rate [rad/s] for the next tick."""
        if self._wait_s > 0.0:
            self._wait_s -= self._tick_s
            return 0.0, 0.0
        goal = self._goal
        if goal is None:
            return 0.0, 0.0
        dx, dy = goal.x - x, goal.y - y
        sign = -1.0 if goal.backwards else 1.0
        turn = math.remainder(math.atan2(sign * dy, sign * dx) - yaw, math.tau)
        left_m = math.hypot(dx, dy) * math.cos(turn) if self._aimed else math.hypot(dx, dy)
        if left_m < _ARRIVED_M:
            self._goal, self._aimed, self._wait_s = next(self._goals, None), False, goal.pause_s
            return 0.0, 0.0
        rate = max(-_TURN_RAD_S, min(_TURN_RAD_S, _ABOUT * turn))
        self._aimed = self._aimed or abs(turn) < _AIM_RAD
        if not self._aimed:
            return 0.0, rate
        return sign * min(goal.speed_m_s, _BRAKE * left_m), rate

    def resume(self, x: float, y: float) -> None:
        """Aim anew from here."""
        self._aimed = False
