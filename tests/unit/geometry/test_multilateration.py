"""Positions from ranges: exact ones, noisy ones with a consistent covariance, too few and contradictory ones."""

import math

import numpy as np
import pytest

from groundstation.geometry.multilateration import fix_from_ranges, horizontal_std_m, likely_in

ANCHORS = [(-3.9, -2.9, 2.9), (3.9, -2.9, 2.9), (3.9, 2.9, 2.9), (-3.9, 2.9, 2.9), (0.0, -2.9, 0.2)]
LIKELY = likely_in(((-3.5, 3.5), (-2.6, 2.6), (-0.1, 2.7)))
PLACE = (1.2, -0.7, 1.1)


def distances(place: tuple[float, float, float] = PLACE) -> list[float]:
    return [math.dist(place, anchor) for anchor in ANCHORS]


def test_exact_ranges_give_the_place_back() -> None:
    fix = fix_from_ranges(ANCHORS, distances(), 0.01, *LIKELY)
    assert fix is not None and math.dist(fix.position_m, PLACE) < 0.005


def test_anchors_in_one_plane_do_not_put_it_behind_them() -> None:
    fix = fix_from_ranges(ANCHORS[:4], distances()[:4], 0.01, *LIKELY)
    assert fix is not None and math.dist(fix.position_m, PLACE) < 0.02


def test_its_covariance_is_that_of_its_errors() -> None:
    rng, squares = np.random.default_rng(4), []
    for _ in range(300):
        noisy = [d + 0.05 * rng.standard_normal() for d in distances()]
        fix = fix_from_ranges(ANCHORS, noisy, 0.05, *LIKELY)
        if fix is not None:
            error = np.array(fix.position_m) - PLACE
            squares.append(error @ np.linalg.solve(fix.covariance, error) / 3)
    assert len(squares) > 290 and 0.8 < np.mean(squares) < 1.2


@pytest.mark.parametrize("wrong", [{0: 0.8}, {4: -0.6}])
def test_ranges_that_contradict_each_other_place_nothing(wrong: dict[int, float]) -> None:
    told = [d + wrong.get(index, 0.0) for index, d in enumerate(distances())]
    assert fix_from_ranges(ANCHORS, told, 0.05, *LIKELY) is None


def test_three_ranges_place_nothing() -> None:
    assert fix_from_ranges(ANCHORS[:3], distances()[:3], 0.05, *LIKELY) is None


def test_the_plane_is_told_worse_from_a_corner_and_not_at_all_by_a_line() -> None:
    middle = horizontal_std_m(ANCHORS, (0.0, 0.0, 1.0), 0.1, 0.1)
    assert 0.05 < middle < horizontal_std_m(ANCHORS[:2], (0.0, 0.0, 1.0), 0.1, 0.1)
    assert horizontal_std_m([(0.0, 0.0, 3.0)], (0.0, 0.0, 1.0), 0.1, 0.1) == math.inf
