"""Paths of simulated targets: each keeps its promise within its base's limits, and repeats for a seed."""

import itertools
import math

import numpy as np
import pytest

from groundstation.errors import SettingsError
from sim_bridge.scenario import TargetScenario, parse_scenario
from sim_bridge.target_paths import AlongWalls, Anywhere, Kidnap, Path, RandomWalk, Sprint, Standstill, Waypoints
from sim_bridge.world.noise import generator_of
from sim_bridge.world.places import Footprint, settled
from sim_bridge.world.unicycle import BASES, Unicycle
from sim_bridge.world.world import TICK_S

HALF_ROOM = (4.0, 3.0)
PATHS = (
    Waypoints(points_m=((0.0, 0.0), (1.0, 0.0), (1.0, 1.0)), speed_m_s=0.4),
    RandomWalk(speed_m_s=0.3),
    Sprint(speed_m_s=0.7),
    Sprint(speed_m_s=0.5, reverse_share=1.0, pause_s=0.3),
    AlongWalls(speed_m_s=0.5),
)


def driven(scenario: TargetScenario, seconds: float, seed: int = 1) -> np.ndarray:
    """Return rows of the truth board, 200 Hz."""
    robot = Unicycle(scenario, TICK_S, generator_of(seed, "target"), HALF_ROOM)
    rows = []
    for _ in range(round(seconds / TICK_S)):
        robot.step()
        rows.append(robot.row())
    return np.array(rows)


def on(path: Path, seconds: float = 20.0, seed: int = 1, **more: object) -> np.ndarray:
    return driven(TargetScenario.model_validate({"path": path, "departs_after_team_s": None, **more}), seconds, seed)


@pytest.mark.parametrize("path", PATHS)
def test_a_target_keeps_within_its_base_and_the_room(path: Path) -> None:
    rows = on(path, 30.0)
    speed = np.hypot(rows[:, 3], rows[:, 4])
    assert speed.max() <= BASES["turtlebot_2"].speed_m_s + 1e-9
    assert np.abs(rows[:, 11]).max() <= math.pi
    assert (np.abs(rows[:, :2]) <= HALF_ROOM).all()
    assert np.median(speed[speed > 0.01]) > 0.2


@pytest.mark.parametrize("path", PATHS[1:4])
def test_chance_belongs_to_the_seed(path: Path) -> None:
    assert np.array_equal(on(path, 5.0, seed=3), on(path, 5.0, seed=3))
    assert not np.array_equal(on(path, 5.0, seed=3), on(path, 5.0, seed=4))


def test_waypoints_are_reached_in_order_and_paused_at() -> None:
    points = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))
    rows = on(Waypoints(points_m=points, speed_m_s=0.4, pause_s=1.0, after_last="stop"), 15.0)
    reached = [int(np.argmin(np.hypot(*(rows[:, :2] - point).T))) for point in points[1:]]
    assert all(np.hypot(*(rows[k, :2] - point)) < 0.1 for k, point in zip(reached, points[1:], strict=True))
    assert reached[0] < reached[1]
    assert np.hypot(*rows[-1, 3:5]) == pytest.approx(0.0, abs=1e-6)


def test_a_corridor_is_driven_there_and_back() -> None:
    rows = on(Waypoints(points_m=((-1.0, 0.0), (1.0, 0.0)), speed_m_s=0.5, after_last="back"), 20.0)
    assert rows[:, 0].max() > 0.9
    assert rows[len(rows) // 2 :, 0].min() < -0.9


def test_sharp_turns_are_sharp() -> None:
    rows = on(Sprint(speed_m_s=0.5, leg_s=(2.0, 2.0), turn_deg=(90.0, 90.0)), 30.0)
    assert np.abs(rows[:, 11]).max() > 2.0
    assert np.hypot(rows[:, 3], rows[:, 4]).max() > 0.45


def test_a_target_that_backs_out_goes_backwards() -> None:
    rows = on(Sprint(speed_m_s=0.4, reverse_share=1.0), 20.0)
    along = rows[:, 3] * np.cos(rows[:, 8]) + rows[:, 4] * np.sin(rows[:, 8])
    assert along.min() < -0.3
    assert along.max() > 0.3


def test_along_walls_keeps_its_distance() -> None:
    rows = on(AlongWalls(speed_m_s=0.7, from_wall_m=0.5), 60.0)
    nearest = np.min(HALF_ROOM - np.abs(rows[:, :2]), axis=1)
    assert nearest.max() < 0.75
    assert nearest.min() > 0.3
    assert {(x > 0, y > 0) for x, y in rows[:, :2]} == set(itertools.product((True, False), repeat=2))


@pytest.mark.parametrize("path", [Standstill(), RandomWalk()])
def test_a_kidnapped_target_is_elsewhere_from_one_tick_to_the_next(path: Path) -> None:
    rows = on(path, 6.0, kidnaps=[Kidnap(at_s=2.0, distance_m=2.0), Kidnap(at_s=4.0, to_m=(1.0, -1.0))])
    steps = np.hypot(*np.diff(rows[:, :2], axis=0).T)
    jumps = np.flatnonzero(steps > 0.1)
    assert [round((k + 2) * TICK_S, 2) for k in jumps] == [2.0, 4.0]
    assert 1.9 < steps[jumps[0]] < 2.1
    assert rows[jumps[1] + 1, :2] == pytest.approx((1.0, -1.0), abs=0.01)


def test_a_place_anywhere_is_clear_of_walls_and_what_stands_and_covers_the_floor() -> None:
    table, pad = Footprint(1.0, 0.0, 1.2, 0.6), Footprint(-2.0, 1.0)
    places = []
    for seed in range(300):
        place = settled(Anywhere(clear_m=0.5), HALF_ROOM, (table, pad), generator_of(seed, "place"))
        assert isinstance(place, Standstill)
        places.append(place.position_m)
    x, y = np.array(places).T
    assert 3.4 < np.abs(x).max() <= 3.5
    assert 2.4 < np.abs(y).max() <= 2.5
    assert min(table.distance_m(*at) for at in places) >= 0.5
    assert min(math.dist(at, (-2.0, 1.0)) for at in places) >= 0.5
    quarters, _, _ = np.histogram2d(x, y, bins=2, range=((-3.5, 3.5), (-2.5, 2.5)))
    assert quarters.min() > 50


def test_a_floor_without_room_is_refused() -> None:
    with pytest.raises(SettingsError, match=r"no place is 0\.5 m clear"):
        settled(Anywhere(), HALF_ROOM, (Footprint(0.0, 0.0, 8.0, 6.0),), generator_of(1, "place"))
    with pytest.raises(SettingsError, match="no place is 9 m clear"):
        settled(Anywhere(clear_m=9.0), HALF_ROOM, (), generator_of(1, "place"))


def test_a_person_is_faster_than_a_turtlebot() -> None:
    rows = on(Waypoints(points_m=((-3.0, 0.0), (3.0, 0.0)), speed_m_s=1.4), 4.0, base="person", max_speed_m_s=1.5)
    assert np.hypot(rows[:, 3], rows[:, 4]).max() > 1.3


def test_a_scenario_file_names_them() -> None:
    text = '{"target": {"path": {"shape": "waypoints", "points_m": [[0, 0], [1, 0]], "speeds_m_s": [0.2, 0.5]}}}'
    path = parse_scenario(text).target.path
    assert isinstance(path, Waypoints)
    assert path.speeds_m_s == (0.2, 0.5)
