"""Stands of several robots: far enough apart, in view, and equal for equal beliefs."""

import math
import random
from itertools import combinations

import pytest

from groundstation.control.search_spacing import apart
from groundstation.control.stand import Stand
from groundstation.sensing.models import Rectangle

VIEW = Rectangle((-1.0, 1.0), (-0.5, 0.5))


def spread(wanted: list[tuple[float, float]], view: Rectangle | None, distance_m: float = 1.0) -> list[Stand]:
    stands = {f"d{i}": Stand(x, y, 0.3, 0.1) for i, (x, y) in enumerate(wanted)}
    at = dict.fromkeys(stands, (0.0, 0.0))
    return list(apart(stands, at, dict.fromkeys(stands, view), distance_m).values())


def least_m(stands: list[Stand]) -> float:
    return min(math.dist((a.x, a.y), (b.x, b.y)) for a, b in combinations(stands, 2))


def test_stands_that_are_apart_stay_as_they_are() -> None:
    assert spread([(-0.7, 0.0), (0.7, 0.1)], VIEW) == [Stand(-0.7, 0.0, 0.3, 0.1), Stand(0.7, 0.1, 0.3, 0.1)]


def test_of_two_equal_stands_in_a_corner_the_second_gives_way_along_the_view() -> None:
    first, second = spread([(1.0, 0.5), (1.0, 0.5)], VIEW)
    assert (first.x, first.y) == (1.0, 0.5)
    assert math.hypot(second.x - first.x, second.y - first.y) == pytest.approx(1.0)
    assert VIEW.nearest(second.x, second.y) == pytest.approx((second.x, second.y))


def test_robots_give_way_to_their_own_side() -> None:
    view = Rectangle((-2.0, 2.0), (-2.0, 2.0))
    stands = {"a": Stand(2.0, 2.0, 0.0), "b": Stand(2.0, 2.0, 0.0)}
    for place in ((-1.0, 2.0), (2.0, -1.0)):
        moved = apart(stands, {"a": (2.0, 2.0), "b": place}, dict.fromkeys(stands, view), 1.0)["b"]
        assert math.dist((moved.x, moved.y), place) == pytest.approx(2.0, abs=1e-6)


def test_any_stands_are_apart_and_in_view_where_the_view_has_room() -> None:
    draw = random.Random(4)
    for _ in range(300):
        count = draw.choice((2, 3))
        view = Rectangle((-draw.uniform(1.0, 3.0), draw.uniform(1.0, 3.0)), (-0.5, draw.uniform(0.6, 2.0)))
        middle = draw.uniform(-3, 3), draw.uniform(-3, 3)
        wanted = [view.nearest(middle[0] + draw.gauss(0, 0.3), middle[1] + draw.gauss(0, 0.3)) for _ in range(count)]
        stands = spread(wanted, view)
        assert least_m(stands) >= 1.0 - 1e-9
        for stand in stands:
            assert math.dist(view.nearest(stand.x, stand.y), (stand.x, stand.y)) < 1e-8
        assert stands == spread(wanted, view)


def test_two_robots_in_a_view_too_small_stand_in_opposite_corners() -> None:
    small = Rectangle((-0.3, 0.3), (-0.2, 0.2))
    assert least_m(spread([(0.0, 0.0), (0.1, 0.1)], small)) == pytest.approx(math.hypot(0.6, 0.4))


def test_without_a_view_a_stand_gives_way_straight() -> None:
    first, second = spread([(0.0, 0.0), (0.3, 0.4)], None)
    assert (first.x, first.y) == (0.0, 0.0)
    assert (second.x, second.y) == pytest.approx((0.6, 0.8))
