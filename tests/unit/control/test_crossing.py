"""Straight routes from one world-fixed view into the next, in fields of one, two and three views."""

import math

import numpy as np
import pytest

from groundstation.control.crossing import gap_about_m, hold, into, is_inside, passage, unseen_way_m, view_around
from groundstation.sensing.models import Rectangle

WEST, EAST = Rectangle((-3.0, -0.3), (-0.7, 0.7)), Rectangle((0.3, 3.0), (-0.7, 0.7))
NORTH = Rectangle((-1.0, 1.0), (1.0, 3.0))
OVER = Rectangle((-1.0, 1.0), (-0.7, 0.7))


def at(x: float, y: float) -> np.ndarray:
    return np.array([x, y])


@pytest.mark.parametrize(
    ("views", "velocity", "leaves_m", "reaches_m"),
    [
        ((WEST, EAST), at(0.4, 0.0), 0.2, 0.8),
        ((WEST, EAST), at(0.4, 0.3), 0.25, 1.0),
        ((WEST, EAST), at(0.4, 0.39), 0.2, 0.8),
        ((WEST, NORTH), at(0.0, 0.2), 0.7, 1.0),
        ((WEST, EAST, NORTH), at(0.1, 0.0), 0.2, 0.8),
    ],
)
def test_a_way_into_another_view(
    views: tuple[Rectangle, ...], velocity: np.ndarray, leaves_m: float, reaches_m: float
) -> None:
    found = passage(at(-0.5, 0.0), velocity, views)
    assert found is not None
    assert (found.leaves_m, found.reaches_m) == pytest.approx((leaves_m, reaches_m))
    assert found.gap_m == pytest.approx(reaches_m - leaves_m)


@pytest.mark.parametrize(
    ("views", "velocity"),
    [
        ((WEST,), at(0.4, 0.0)),
        ((WEST, EAST), at(-0.4, 0.0)),
        ((WEST, EAST), at(0.0, 0.4)),
        ((WEST, EAST), at(0.0, 0.0)),
        ((), at(0.4, 0.0)),
        ((EAST,), at(0.4, 0.0)),
    ],
    ids=["one view", "away from the other", "past the other", "it stands", "no view", "it is in none"],
)
def test_a_way_into_no_other_view(views: tuple[Rectangle, ...], velocity: np.ndarray) -> None:
    assert passage(at(-0.5, 0.0), velocity, views) is None


def test_views_that_overlap_have_no_gap() -> None:
    found = passage(at(-1.5, 0.0), at(0.3, 0.0), (WEST, OVER, EAST))
    assert found is not None and found.gap_m == 0.0 and found.reaches_m == pytest.approx(0.5)


def test_a_place_belongs_to_the_view_in_which_it_is_deepest() -> None:
    assert view_around(at(-0.9, 0.0), (WEST, OVER)) is WEST
    assert view_around(at(-0.4, 0.0), (WEST, OVER)) is OVER
    assert view_around(at(-0.2, 0.0), (WEST, EAST)) is WEST
    assert view_around(at(0.0, 0.0), ()) is None
    assert is_inside(at(-0.3, 0.7), (WEST,)) and not is_inside(at(0.0, 0.0), (WEST, EAST))


def test_a_gap_is_as_wide_as_what_lies_between_its_two_views() -> None:
    for x in (-0.2, 0.0, 0.29):
        assert gap_about_m(at(x, 0.0), (WEST, EAST, NORTH)) == pytest.approx(0.6)
    assert gap_about_m(at(0.0, 0.0), (WEST,)) == math.inf


@pytest.mark.parametrize(
    ("leaves_m", "speed", "most", "way_m"),
    [(0.0, 0.6, 0.6, 0.6), (0.3, 0.6, 0.6, 0.6), (0.0, 0.0, 0.6, 0.28), (9.0, 0.0, 0.6, 0.6), (0.1, 0.2, 0.0, 0.0)],
    ids=["at full speed", "the same, later", "from standing", "after a long run", "not at all"],
)
def test_how_far_one_gets_unseen_in_a_second(leaves_m: float, speed: float, most: float, way_m: float) -> None:
    assert unseen_way_m(leaves_m, speed, most, 0.7, 1.0) == pytest.approx(way_m, abs=0.01)


def test_a_held_robot_stops_at_the_border_and_slides_along_it() -> None:
    assert hold(WEST, at(-0.5, 0.0), at(0.6, 0.3), 0.5) == pytest.approx([0.2, 0.3])
    assert hold(WEST, at(0.5, 0.0), at(0.6, 0.3), 0.5) == pytest.approx([-0.5, 0.3])


@pytest.mark.parametrize(
    ("place", "velocity", "most", "wanted"),
    [
        (at(0.0, 0.2), at(-0.2, 0.1), 0.6, (0.6, 0.1)),
        (at(0.25, 0.0), at(-0.2, 0.5), 0.6, (0.45, 0.3)),
        (at(0.25, 0.0), at(0.5, 0.0), 0.6, (0.5, 0.0)),
        (at(0.0, 0.65), at(0.0, 0.3), 0.6, (0.6, 0.05)),
        (at(1.0, 0.72), at(0.3, 0.2), 0.6, (0.3, -0.36)),
    ],
    ids=[
        "straight",
        "less aside, slower near the border",
        "as it wants to",
        "not past it",
        "only back over one border",
    ],
)
def test_a_robot_outside_a_view_flies_straight_in(
    place: np.ndarray, velocity: np.ndarray, most: float, wanted: tuple[float, float]
) -> None:
    assert into(EAST, place, velocity, most) == pytest.approx(wanted)
