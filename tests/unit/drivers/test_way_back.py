"""Whatever a tracker asks for, a hovering vehicle is moved slowly and not far."""

import math
import random

import pytest

from drivers.way_back import WayBack

S = 1_000_000_000
STEP_S = 1 / 30


def flown(asked, seconds, seed=0):
    """Return the way that was let through (forward, left) after each step [m]."""
    bound, random_of, way, ways = WayBack(), random.Random(seed), (0.0, 0.0), []
    for step in range(round(seconds / STEP_S)):
        velocity = bound.step(round((1 + step * STEP_S) * S), asked(step * STEP_S, random_of))
        if velocity is not None:
            assert math.hypot(*velocity) <= 0.2 + 1e-9
            way = (way[0] + velocity[0] * STEP_S, way[1] + velocity[1] * STEP_S)
        ways.append(way)
    return ways


def test_a_tracker_that_has_gone_mad_moves_it_little():
    ways = flown(lambda at_s, _: (5.0, 0.0), 30.0)
    for step, way in enumerate(ways):
        assert math.hypot(*way) <= 0.5 + 0.1 * step * STEP_S + 0.02


@pytest.mark.parametrize("seed", range(20))
def test_the_bound_holds_between_any_two_moments(seed):
    def asked(at_s, random_of):
        return None if random_of.random() < 0.1 else (random_of.gauss(0.1, 0.3), random_of.gauss(0.0, 0.3))

    ways = flown(asked, 40.0, seed)
    for first in range(0, len(ways), 50):
        for last in range(first, len(ways), 50):
            moved_m = math.dist(ways[first], ways[last])
            assert moved_m <= 1.0 + 0.1 * (last - first) * STEP_S + 0.02


def test_a_steady_drift_is_countered_for_ever():
    ways = flown(lambda at_s, _: (0.0, 0.08), 300.0)
    assert ways[-1][1] == pytest.approx(24.0, abs=0.01)


def test_the_way_back_is_open_at_the_limit():
    bound = WayBack()
    for step in range(300):
        bound.step(round((1 + step * STEP_S) * S), (0.2, 0.0))
    assert bound.step(11 * S, (0.2, 0.0)) is None
    assert bound.step(round(11.03 * S), (-0.2, 0.0)) == (-0.2, 0.0)


@pytest.mark.parametrize("asked", [None, (math.nan, 0.0), (0.0, math.inf)])
def test_nothing_asked_is_its_own_hover(asked):
    assert WayBack().step(S, asked) is None
