"""The TurtleBot 2: a Kobuki base that follows a path or is steered, with limits and slipping wheels."""

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from sim_bridge.scenario import TargetScenario
from sim_bridge.target_paths import Path, Standstill
from sim_bridge.world.course import Course, course_of
from sim_bridge.world.noise import GaussMarkov, standard_normals

# Kobuki: 0.7 m/s and 180 deg/s; accelerations of its velocity smoother.
KOBUKI_SPEED_M_S = 0.7
KOBUKI_TURN_RATE_RAD_S = math.pi
ACCELERATION_M_S2 = 0.5
TURN_ACCELERATION_RAD_S2 = 3.5
_SLIP_CORRELATION_S = 1.5


class BaseLimits(NamedTuple):
    """Limits of a base: speed [m/s], acceleration [m/s^2], turn rate [rad/s], turn acceleration [rad/s^2]."""

    speed_m_s: float
    acceleration_m_s2: float
    turn_rate_rad_s: float
    turn_acceleration_rad_s2: float


BASES = {
    "turtlebot_2": BaseLimits(KOBUKI_SPEED_M_S, ACCELERATION_M_S2, KOBUKI_TURN_RATE_RAD_S, TURN_ACCELERATION_RAD_S2),
    "person": BaseLimits(1.5, 2.0, math.tau, 20.0),
    "rc_car": BaseLimits(3.0, 4.0, math.pi, 20.0),
}
_WALL_M = 0.5


class Unicycle:
    """State x, y, yaw, forward speed and turn rate [world]."""

    def __init__(
        self,
        scenario: TargetScenario,
        tick_s: float,
        rng: np.random.Generator,
        half_room_m: tuple[float, float] = (50.0, 50.0),
    ) -> None:
        # Streams of their own: its path does not change the slip of its wheels.
        on_course, self._rng = rng.spawn(2)
        draw = standard_normals(rng)
        self._tick_s = tick_s
        self._limits, self._half_room_m = BASES[scenario.base], half_room_m
        self._max_speed = min(scenario.max_speed_m_s, self._limits.speed_m_s)
        self._course = course_of(scenario.path, tick_s, half_room_m, on_course)
        self._steered: tuple[float, float] | None = None if self._course else (0.0, 0.0)
        self._kidnaps = deque(sorted(scenario.kidnaps, key=lambda kidnap: kidnap.at_s))
        self._driven_ticks = 0
        self._slip = GaussMarkov(scenario.slip, _SLIP_CORRELATION_S, tick_s, draw)
        self._turn_slip = GaussMarkov(scenario.slip, _SLIP_CORRELATION_S, tick_s, draw)
        self.x, self.y, self.yaw = _start(scenario.path, self._course)
        self.speed = self.turn_rate = 0.0
        self._wheels = (0.0, 0.0)
        self.parked = scenario.departs_after_team_s is not None

    def drive(self, speed_m_s: float, turn_rate_rad_s: float) -> None:
        """Leave the path and drive at these speeds (within the limits) until the next command."""
        self._steered = (speed_m_s, turn_rate_rad_s)

    def follow_path(self) -> None:
        """Continue along the path, an eight from its nearest point; without a path, stop."""
        if self._course is None:
            self._steered = (0.0, 0.0)
        else:
            self._course.resume(self.x, self.y)
            self._steered = None

    def place(self, x_m: float, y_m: float) -> None:
        """Move to another place at once, at rest."""
        self.x, self.y = x_m, y_m
        self.speed = self.turn_rate = 0.0
        self._wheels = (0.0, 0.0)

    def step(self) -> None:
        """Advance by one tick."""
        limits = self._limits
        if self._kidnaps and not self.parked:
            self._kidnap()
        parked = self.parked and self._steered is None
        speed, turn_rate = (0.0, 0.0) if parked else self._asked()
        self._wheels = (
            _approach(self._wheels[0], _clamp(speed, self._max_speed), limits.acceleration_m_s2 * self._tick_s),
            _approach(
                self._wheels[1],
                _clamp(turn_rate, limits.turn_rate_rad_s),
                limits.turn_acceleration_rad_s2 * self._tick_s,
            ),
        )
        # Slipping wheels cover less than they turn, and turn no faster than the base's limits.
        self.speed = _clamp(self._wheels[0] * (1.0 + self._slip.step()), limits.speed_m_s)
        self.turn_rate = _clamp(self._wheels[1] * (1.0 + self._turn_slip.step()), limits.turn_rate_rad_s)
        self.yaw = math.remainder(self.yaw + self.turn_rate * self._tick_s, math.tau)
        self.x += self.speed * math.cos(self.yaw) * self._tick_s
        self.y += self.speed * math.sin(self.yaw) * self._tick_s

    def confine(self, half_x_m: float, half_y_m: float) -> None:
        """Stop at the walls."""
        self.x, self.y = _clamp(self.x, half_x_m), _clamp(self.y, half_y_m)

    @property
    def wheels(self) -> tuple[float, float]:
        """Return speed [m/s] and turn rate [rad/s] by the turning of the wheels, before slip."""
        return self._wheels

    def row(self) -> tuple[float, ...]:
        """Return the 13 numbers of the truth board."""
        vx, vy = self.speed * math.cos(self.yaw), self.speed * math.sin(self.yaw)
        return (self.x, self.y, 0.0, vx, vy, 0.0, 0.0, 0.0, self.yaw, 0.0, 0.0, self.turn_rate, 1.0)

    def _asked(self) -> tuple[float, float]:
        if self._steered is not None:
            return self._steered
        assert self._course is not None
        return self._course.drive(self.x, self.y, self.yaw)

    def _kidnap(self) -> None:
        """Move the target elsewhere when a kidnap is due."""
        self._driven_ticks += 1
        while self._kidnaps and self._driven_ticks * self._tick_s >= self._kidnaps[0].at_s:
            kidnap = self._kidnaps.popleft()
            goal = kidnap.to_m or _away(self.x, self.y, kidnap.distance_m, self._half_room_m, self._rng)
            self.place(*goal)
            if self._course is not None:
                self._course.resume(*goal)


def _away(
    x: float, y: float, distance_m: float, half_room_m: tuple[float, float], rng: np.random.Generator
) -> tuple[float, float]:
    """Return a place at a distance in a random direction, not near a wall; if there is none, the farthest tried."""
    tried = []
    for angle in rng.uniform(-math.pi, math.pi, 32).tolist():
        there = x + distance_m * math.cos(angle), y + distance_m * math.sin(angle)
        inside = tuple(_clamp(a, half - _WALL_M) for a, half in zip(there, half_room_m, strict=True))
        tried.append((inside[0], inside[1]))
        if inside == there:
            return there
    return max(tried, key=lambda at: math.dist(at, (x, y)))


def _start(path: Path, course: Course | None) -> tuple[float, float, float]:
    if course is not None:
        return course.start
    assert isinstance(path, Standstill)
    return *path.position_m, math.radians(path.yaw_deg)


def _clamp(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


def _approach(value: float, goal: float, largest_step: float) -> float:
    return value + _clamp(goal - value, largest_step)
