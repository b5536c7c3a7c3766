"""A hovering vehicle is moved slowly and not far, whatever the tracker requests."""

import math
import random

import pytest

from drivers.way_back import WayBack

S = 1_000_000_000
STEP_S = 1 / 30


def flown(asked, seconds, seed=0):
    """Return the distance let through (forward, left) after each step [m]."""
    bound, random_of, way, ways = WayBack(), random.Random(seed), (0.0, 0.0, 0.0), []
    for step in range(round(seconds / STEP_S)):
        velocity = bound.step(round((1 + step * STEP_S) * S), asked(step * STEP_S, random_of))
        if velocity is not None:
            assert math.hypot(*velocity) <= 0.2 + 1e-9
            x, y, z = (a + b * STEP_S for a, b in zip(way, velocity, strict=True))
            way = (x, y, z)
        ways.append(way)
    return ways


def test_a_tracker_that_has_gone_mad_moves_it_little():
    ways = flown(lambda at_s, _: (3.0, 0.0, 4.0), 30.0)
    for step, way in enumerate(ways):
        assert math.hypot(*way) <= 0.5 + 0.1 * step * STEP_S + 0.02


@pytest.mark.parametrize("seed", range(20))
def test_the_bound_holds_between_any_two_moments(seed):
    def asked(at_s, random_of):
        return None if random_of.random() < 0.1 else tuple(random_of.gauss(mean, 0.3) for mean in (0.1, 0.0, -0.1))

    ways = flown(asked, 40.0, seed)
    for first in range(0, len(ways), 50):
        for last in range(first, len(ways), 50):
            moved_m = math.dist(ways[first], ways[last])
            assert moved_m <= 1.0 + 0.1 * (last - first) * STEP_S + 0.02


def test_a_steady_drift_is_countered_for_ever():
    ways = flown(lambda at_s, _: (0.0, 0.08, 0.0), 300.0)
    assert ways[-1][1] == pytest.approx(24.0, abs=0.01)


def test_the_way_back_is_open_at_the_limit():
    bound = WayBack()
    for step in range(300):
        bound.step(round((1 + step * STEP_S) * S), (0.2, 0.0, 0.0))
    assert bound.step(11 * S, (0.2, 0.0, 0.0)) is None
    assert bound.step(round(11.03 * S), (-0.2, 0.0, 0.0)) == (-0.2, 0.0, 0.0)


def obeys_for(bound, velocity, since_s, step_s=STEP_S):
    """Return how long a velocity is let through without a break [s], at most 60."""
    for step in range(1, round(60 / step_s)):
        if bound.step(round((since_s + step * step_s) * S), velocity) is None:
            return (step - 1) * step_s
    return 60.0


def test_half_a_metre_is_let_through_at_full_speed_and_a_metre_from_one_side_to_the_other():
    """0.2 m/s less the 0.1 m/s that are forgotten: 0.5 m last 5 s, and from there 1 m back 10/3 s and 5 s."""
    bound = WayBack()
    bound.step(S, (0.2, 0.0, 0.0))
    assert obeys_for(bound, (0.2, 0.0, 0.0), 1.0) == pytest.approx(5.0, abs=0.1)
    assert obeys_for(bound, (-0.2, 0.0, 0.0), 7.0) == pytest.approx(0.4 / 0.3 + 5.0, abs=0.1)


@pytest.mark.parametrize("across", [(0.2, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, -0.2)])
def test_the_used_distance_is_restored_by_a_decimetre_a_second(across):
    """A second of standing, and a gap that counts as 0.2 s, free 0.12 m, which last 1.2 s."""
    bound = WayBack()
    bound.step(S, across)
    obeys_for(bound, across, 1.0)
    for step in range(1, 31):
        assert bound.step(round((7 + step * STEP_S) * S), (0.0, 0.0, 0.0)) == (0.0, 0.0, 0.0)
    assert obeys_for(bound, across, 8.0) == pytest.approx(1.2, abs=0.1)


def test_a_driver_that_stood_still_counts_a_fifth_of_a_second_at_most():
    """At 0.2 m/s that is 0.04 m of the half metre."""
    bound = WayBack()
    bound.step(S, (0.2, 0.0, 0.0))
    bound.step(31 * S, (0.2, 0.0, 0.0))
    assert obeys_for(bound, (0.2, 0.0, 0.0), 31.0) == pytest.approx(4.6, abs=0.1)


@pytest.mark.parametrize("asked", [None, (math.nan, 0.0, 0.0), (0.0, math.inf, 0.0), (0.0, 0.0, math.nan)])
def test_nothing_asked_is_its_own_hover(asked):
    assert WayBack().step(S, asked) is None
