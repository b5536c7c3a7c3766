"""The shortest way round obstacles, at a distance, inside the fence."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.planning.detours import Detours
from groundstation.sensing.models import Box, Rectangle
from groundstation.vectors import Vector2

PILLAR, TABLE = Box((0.0, 0.0), (0.4, 0.4, 3.0)), Box((2.0, 0.0), (1.0, 1.0, 0.75))
FENCE = Rectangle((-4.0, 4.0), (-3.0, 3.0))
ROOM = Detours((PILLAR, TABLE), 0.6, FENCE)
LOW_M, HIGH_M = 1.1, 1.5  # past a table, and over it


def flown(detours: Detours, place: Vector2, goal: Vector2, height_m: float = LOW_M) -> tuple[float, float]:
    """Follow the ways; returns the length flown, and the least distance from an obstacle [m]."""
    length, least, x, y = 0.0, math.inf, *place
    for _ in range(4000):
        way = detours.way((x, y), goal, height_m)
        step = min(0.01, math.dist((x, y), way.next_m))
        if step < 1e-9:
            break
        share = step / math.dist((x, y), way.next_m)
        x, y, length = x + share * (way.next_m[0] - x), y + share * (way.next_m[1] - y), length + step
        least = min(least, *(float(box.distances_m(np.array([[x, y, height_m]]))[0]) for box in detours.obstacles))
    assert (x, y) == pytest.approx(goal, abs=1e-6)
    return length, least


def test_without_obstacles_or_beside_them_the_way_is_straight() -> None:
    for detours, goal in ((Detours(), (3.0, 0.0)), (ROOM, (-3.0, 2.0))):
        way = detours.way((-3.0, 0.0), goal, LOW_M)
        assert way.is_straight and way.next_m == goal and way.length_m == math.dist((-3.0, 0.0), goal)


def test_the_way_round_a_pillar_is_the_shorter_one() -> None:
    way = ROOM.way((-3.0, 0.2), (0.85, 0.2), LOW_M)
    assert not way.is_straight and way.next_m == pytest.approx((-0.9, 0.9))
    assert way.length_m == pytest.approx(math.hypot(2.1, 0.7) + 1.8 + math.hypot(0.05, 0.7))
    assert ROOM.extra_m((-3.0, 0.2), (0.85, 0.2), LOW_M) == pytest.approx(way.length_m - 3.85)


def test_a_high_robot_flies_over_a_table_and_a_low_one_round_it() -> None:
    begin, end = (2.0, -2.0), (2.0, 2.0)
    assert ROOM.way(begin, end, HIGH_M).is_straight
    assert not ROOM.way(begin, end, LOW_M).is_straight


PLACES = st.tuples(st.floats(-3.9, 3.9), st.floats(-2.9, 2.9))


@given(PLACES, PLACES)
@settings(max_examples=40, deadline=None)
def test_every_way_ends_and_keeps_its_distance(place: Vector2, goal: Vector2) -> None:
    gaps = [-box.outline.depth_m(*point) for box in ROOM.obstacles for point in (place, goal)]
    if min(gaps[::2]) < 0.05 or min(gaps[1::2]) < 0.6:
        return
    length, least = flown(ROOM, place, goal)
    assert least >= min(0.55, *gaps) - 1e-6
    # From beside a corner the way turns a little sooner than planned; out of a place too near it bends.
    assert min(gaps) < 0.6 or length <= ROOM.way(place, goal, LOW_M).length_m + 1e-6


def test_a_goal_in_an_obstacle_is_approached_as_far_as_allowed() -> None:
    way = ROOM.way((-3.0, 0.0), (0.0, 0.1), LOW_M)
    assert way.is_known and ROOM.clear_of(np.array([way.next_m]), LOW_M).all()
    assert ROOM.way((-3.0, 0.0), (-0.7, 0.0), LOW_M).next_m == pytest.approx((-0.8, 0.0))


def test_who_is_over_an_obstacle_too_low_leaves_it_by_the_nearest_side() -> None:
    way = ROOM.way((2.3, 0.1), (-3.0, 0.0), LOW_M)
    assert not way.is_straight and way.next_m == pytest.approx((2.5, 0.1))


def test_no_way_leaves_the_fence() -> None:
    """Where the wall leaves no room on one side, the way is on the other one; without any it is straight."""
    by_the_wall = Detours((Box((0.0, 2.0), (0.4, 1.6, 3.0)),), 0.6, FENCE)
    way = by_the_wall.way((-2.0, 2.6), (2.0, 2.6), LOW_M)
    assert way.next_m[1] < 2.0 and not way.is_straight
    across = Detours((Box((0.0, 0.0), (0.4, 5.0, 3.0)),), 0.6, FENCE)
    assert across.way((-2.0, 0.0), (2.0, 0.0), LOW_M).is_straight


def test_places_too_near_to_an_obstacle_are_not_clear() -> None:
    places = np.array([[0.0, 0.0], [0.75, 0.0], [0.85, -2.0], [2.0, 0.0], [-2.0, 0.0]])
    assert ROOM.clear_of(places, LOW_M).tolist() == [False, False, True, False, True]
    assert ROOM.clear_of(places, HIGH_M).tolist() == [False, False, True, True, True]
