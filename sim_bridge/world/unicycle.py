"""The TurtleBot 2: a Kobuki base that follows a path or is steered, with limits and slipping wheels."""

import math

import numpy as np

from sim_bridge.scenario import FigureEight, TargetScenario
from sim_bridge.world.noise import GaussMarkov, standard_normals
from sim_bridge.world.path import EightPath

# Kobuki: 0.7 m/s and 180 deg/s; accelerations of its velocity smoother.
KOBUKI_SPEED_M_S = 0.7
KOBUKI_TURN_RATE_RAD_S = math.pi
ACCELERATION_M_S2 = 0.5
TURN_ACCELERATION_RAD_S2 = 3.5
_SLIP_CORRELATION_S = 1.5

# Path follower: aims at a point of the path's tangent this far ahead; gains along it [1/s] and on the heading [1/s].
_LOOK_AHEAD_M = 0.4
_ALONG, _ABOUT = 1.0, 2.5
_LARGEST_ERROR_M = 0.5


class Unicycle:
    """State x, y, yaw, forward speed and turn rate [world]."""

    def __init__(self, scenario: TargetScenario, tick_s: float, rng: np.random.Generator) -> None:
        draw = standard_normals(rng)
        self._tick_s = tick_s
        self._max_speed = min(scenario.max_speed_m_s, KOBUKI_SPEED_M_S)
        self._path = EightPath(scenario.path) if isinstance(scenario.path, FigureEight) else None
        self._steered: tuple[float, float] | None = None if self._path else (0.0, 0.0)
        self._slip = GaussMarkov(scenario.slip, _SLIP_CORRELATION_S, tick_s, draw)
        self._turn_slip = GaussMarkov(scenario.slip, _SLIP_CORRELATION_S, tick_s, draw)
        self.x, self.y, self.yaw = _start(scenario, self._path)
        self.speed = self.turn_rate = 0.0
        self._wheels = (0.0, 0.0)
        self.parked = scenario.departs_after_team_s is not None

    def drive(self, speed_m_s: float, turn_rate_rad_s: float) -> None:
        """Leave the path and drive so (within the limits) until told otherwise."""
        self._steered = (speed_m_s, turn_rate_rad_s)

    def follow_path(self) -> None:
        """Go on along the path from its nearest point; without a path, stop."""
        if self._path is None:
            self._steered = (0.0, 0.0)
        else:
            self._path.jump_to_nearest(self.x, self.y)
            self._steered = None

    def place(self, x_m: float, y_m: float) -> None:
        """Be somewhere else, at rest."""
        self.x, self.y = x_m, y_m
        self.speed = self.turn_rate = 0.0
        self._wheels = (0.0, 0.0)

    def step(self) -> None:
        """Advance by one tick."""
        parked = self.parked and self._steered is None
        speed, turn_rate = (0.0, 0.0) if parked else self._steered or self._follow()
        self._wheels = (
            _approach(self._wheels[0], _clamp(speed, self._max_speed), ACCELERATION_M_S2 * self._tick_s),
            _approach(
                self._wheels[1], _clamp(turn_rate, KOBUKI_TURN_RATE_RAD_S), TURN_ACCELERATION_RAD_S2 * self._tick_s
            ),
        )
        # Wheels that slip cover less than they turn, never more than the base can do.
        self.speed = _clamp(self._wheels[0] * (1.0 + self._slip.step()), KOBUKI_SPEED_M_S)
        self.turn_rate = _clamp(self._wheels[1] * (1.0 + self._turn_slip.step()), KOBUKI_TURN_RATE_RAD_S)
        self.yaw = math.remainder(self.yaw + self.turn_rate * self._tick_s, math.tau)
        self.x += self.speed * math.cos(self.yaw) * self._tick_s
        self.y += self.speed * math.sin(self.yaw) * self._tick_s

    def confine(self, half_x_m: float, half_y_m: float) -> None:
        """Stop at the walls."""
        self.x, self.y = _clamp(self.x, half_x_m), _clamp(self.y, half_y_m)

    def row(self) -> tuple[float, ...]:
        """Return the 13 numbers of the truth board."""
        vx, vy = self.speed * math.cos(self.yaw), self.speed * math.sin(self.yaw)
        return (self.x, self.y, 0.0, vx, vy, 0.0, 0.0, 0.0, self.yaw, 0.0, 0.0, self.turn_rate, 1.0)

    def _follow(self) -> tuple[float, float]:
        path = self._path
        assert path is not None
        goal = path.point()
        dx, dy = goal.x - self.x, goal.y - self.y
        c, s = math.cos(goal.heading), math.sin(goal.heading)
        ahead, aside = c * dx + s * dy, c * dy - s * dx
        aim = goal.heading + math.atan2(aside, _LOOK_AHEAD_M)
        turn = math.remainder(aim - self.yaw, math.tau)
        # The running point waits for a robot that is far behind it.
        patience = max(0.0, min(1.0, 1.5 - ahead / _LARGEST_ERROR_M))
        path.advance(path.speed_m_s * self._tick_s * patience)
        speed = max(0.0, path.speed_m_s * math.cos(turn) + _ALONG * _clamp(ahead, _LARGEST_ERROR_M))
        return speed, path.speed_m_s * goal.curvature + _ABOUT * turn


def _start(scenario: TargetScenario, path: EightPath | None) -> tuple[float, float, float]:
    if path is not None:
        point = path.point()
        return point.x, point.y, point.heading
    standstill = scenario.path
    assert not isinstance(standstill, FigureEight)
    return *standstill.position_m, math.radians(standstill.yaw_deg)


def _clamp(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


def _approach(value: float, goal: float, largest_step: float) -> float:
    return value + _clamp(goal - value, largest_step)
