"""The TurtleBot keeps to its path and to the limits of its base."""

import math
from itertools import pairwise

import numpy as np
import pytest

from sim_bridge.scenario import TargetScenario
from sim_bridge.target_paths import FigureEight, Standstill
from sim_bridge.world.noise import generator_of
from sim_bridge.world.unicycle import KOBUKI_SPEED_M_S, Unicycle
from sim_bridge.world.world import TICK_S


def test_the_turtlebot_drives_its_figure_eight() -> None:
    path = FigureEight(half_length_m=3.1, half_width_m=0.8, speed_m_s=0.2)
    robot = Unicycle(TargetScenario(departs_after_team_s=None, path=path), TICK_S, generator_of(1, "turtlebot"))
    rows = []
    for _ in range(round(90 / TICK_S)):
        robot.step()
        rows.append((robot.x, robot.y, robot.speed, robot.turn_rate))
    x, y, speed, turn_rate = np.array(rows).T
    assert np.abs(x).max() == pytest.approx(3.1, abs=0.1)
    assert np.abs(y).max() == pytest.approx(0.8, abs=0.1)
    assert speed[400:].mean() == pytest.approx(0.2, abs=0.01)
    assert speed.max() < 0.35
    phases = np.linspace(0, math.tau, 4000)
    curve = np.column_stack((3.1 * np.sin(phases), 0.8 * np.sin(2 * phases)))
    offset = max(np.hypot(*(curve - point).T).min() for point in np.column_stack((x, y))[::50])
    assert offset < 0.05
    assert np.abs(turn_rate).max() < 1.0


def test_kobuki_limits() -> None:
    robot = Unicycle(TargetScenario(departs_after_team_s=None, path=Standstill()), TICK_S, generator_of(1, "turtlebot"))
    robot.drive(5.0, 50.0)
    speeds, turns = [0.0], [0.0]
    for _ in range(800):
        robot.step()
        speeds.append(robot.speed)
        turns.append(robot.turn_rate)
    assert max(speeds) <= KOBUKI_SPEED_M_S
    assert max(speeds) > 0.6
    assert max(turns) <= math.pi
    assert max(abs(b - a) for a, b in pairwise(speeds)) < 0.05, "wheels do not jump"
    assert speeds[40] == pytest.approx(0.1, abs=0.03), "half a metre per second squared"
    robot.drive(0.0, 0.0)
    for _ in range(600):
        robot.step()
    assert robot.speed == 0.0


def test_the_turtlebot_returns_to_its_path() -> None:
    robot = Unicycle(TargetScenario(departs_after_team_s=None), TICK_S, generator_of(1, "turtlebot"))
    robot.drive(0.3, 0.2)
    for _ in range(2000):
        robot.step()
    robot.follow_path()
    for _ in range(4000):
        robot.step()
    phases = np.linspace(0, math.tau, 4000)
    assert np.hypot(3.1 * np.sin(phases) - robot.x, 0.8 * np.sin(2 * phases) - robot.y).min() < 0.1


def test_slip_makes_odometry_wrong() -> None:
    def end(slip: float) -> tuple[float, float]:
        robot = Unicycle(
            TargetScenario(departs_after_team_s=None, path=Standstill(), slip=slip),
            TICK_S,
            generator_of(3, "turtlebot"),
        )
        robot.drive(0.3, 0.1)
        for _ in range(4000):
            robot.step()
        return robot.x, robot.y

    assert math.dist(end(0.05), end(0.0)) > 0.02
