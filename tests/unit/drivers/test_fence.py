"""Whether a vehicle has left the fence: by its estimate, as sure as that is, and not while it comes back."""

import msgspec
import pytest

from drivers.fence import FenceWatch
from groundstation.bus.messages import EntityEstimate

MS = 1_000_000
FENCE = ((-3.0, 3.0), (-2.0, 2.0), (0.2, 2.5))
INSIDE = (0.0, 0.0, 1.2)


def estimate(place, velocity=(0.0, 0.0, 0.0), stds=(0.02, 0.02, 0.02), contradicted=False):
    covariance = [0.0] * 16
    for axis, std_m in enumerate(stds):
        covariance[5 * axis] = std_m**2
    return EntityEstimate(
        "drone_1", "robot", (*place, 0.5), tuple(covariance), velocity, True, 0.0, contradicted=contradicted
    )


def words(place, velocity=(0.0, 0.0, 0.0), stds=(0.02, 0.02, 0.02), returning_counts=False):
    watch = FenceWatch(FENCE)
    watch.hear(0, estimate(place, velocity, stds))
    return watch.outside(0, returning_counts)


@pytest.mark.parametrize(
    ("place", "outside"),
    [
        ((3.13, 0.0, 1.2), ""),
        ((3.15, 0.0, 1.2), "it is 0.1 m outside the fence"),
        ((-3.13, 0.0, 1.2), ""),
        ((-3.45, 0.0, 1.2), "it is 0.5 m outside the fence"),
        ((0.0, 2.13, 1.2), ""),
        ((0.0, 2.32, 1.2), "it is 0.3 m outside the fence"),
        ((0.0, -2.13, 1.2), ""),
        ((0.0, -2.32, 1.2), "it is 0.3 m outside the fence"),
        ((0.0, 0.0, 2.63), ""),
        ((0.0, 0.0, 2.71), "it is 0.2 m above the fence"),
        ((3.2, -2.9, 2.8), "it is 0.9 m outside the fence"),
        (INSIDE, ""),
        ((0.0, 0.0, -0.5), ""),
    ],
)
def test_it_is_outside_beyond_a_margin_and_two_deviations(place, outside):
    """Of several sides the farthest counts; the floor is no way out."""
    assert words(place) == outside


@pytest.mark.parametrize("axis", range(3))
def test_the_deviation_along_the_axis_counts(axis):
    place = [*INSIDE]
    place[axis] = FENCE[axis][1] + 0.4
    assert words(place, stds=tuple(0.14 if i == axis else 0.5 for i in range(3)))
    assert not words(place, stds=tuple(0.16 if i == axis else 0.0 for i in range(3)))


@pytest.mark.parametrize(
    ("place", "back"),
    [
        ((3.4, 0.0, 1.2), (-1, 0, 0)),
        ((-3.4, 0.0, 1.2), (1, 0, 0)),
        ((0.0, 2.4, 1.2), (0, -1, 0)),
        ((0.0, -2.4, 1.2), (0, 1, 0)),
        ((0.0, 0.0, 2.9), (0, 0, -1)),
    ],
)
def test_one_on_its_way_back_is_left_alone_unless_others_fly_it(place, back):
    for speed_m_s, told in ((0.11, False), (0.1, False), (0.09, True), (0.0, True), (-0.3, True)):
        velocity = tuple(speed_m_s * part for part in back)
        assert (words(place, velocity) != "") is told
        assert words(place, velocity, returning_counts=True)


@pytest.mark.parametrize(
    ("place", "back", "enough_m_s"), [((3.4, 0.0, 1.2), (-1, 0, 0), 0.04), ((0.0, 0.0, 2.9), (0, 0, -1), 0.03)]
)
def test_one_that_may_fly_only_slowly_is_on_its_way_back_at_half_of_that(place, back, enough_m_s):
    watch = FenceWatch(FENCE, max_speed_m_s=0.08, max_climb_m_s=0.06)
    for speed_m_s, told in ((enough_m_s - 0.005, True), (enough_m_s + 0.005, False)):
        watch.hear(0, estimate(place, tuple(speed_m_s * part for part in back)))
        assert bool(watch.outside(0, False)) is told


def test_one_that_comes_back_through_one_side_and_not_through_another_is_told():
    place, back = (3.9, 0.0, 2.8), (-0.3, 0.0, 0.0)
    assert words(place, back) == "it is 0.3 m above the fence"
    assert words(place, back, returning_counts=True) == "it is 0.9 m outside the fence"
    assert words(place, (-0.3, 0.0, -0.3)) == ""


def test_it_stays_outside_until_it_is_back_within_half_of_the_margin():
    watch = FenceWatch(FENCE)
    said = []
    for x in (3.12, 3.2, 3.12, 3.06, 3.04, 3.06, 3.12):
        watch.hear(0, estimate((x, 0.0, 1.2)))
        said.append(bool(watch.outside(0, False)))
    assert said == [False, True, True, True, False, False, False]


def test_one_that_went_out_unseen_stays_outside_while_its_place_becomes_less_sure():
    watch = FenceWatch(FENCE)
    watch.hear(0, estimate((3.4, 0.0, 1.2)))
    watch.hear(20 * MS, estimate((3.4, 0.0, 1.2), stds=(0.5, 0.5, 0.5)))
    assert watch.outside(20 * MS, False)


def test_an_old_estimate_tells_nothing():
    watch = FenceWatch(FENCE)
    assert not watch.outside(0, False)
    watch.hear(1000 * MS, estimate((4.0, 0.0, 1.2)))
    assert watch.outside(1300 * MS, False) and watch.outside(1301 * MS, False) == ""


def test_a_variance_that_rounding_made_negative_is_none():
    said = estimate((3.2, 0.0, 1.2))
    watch = FenceWatch(FENCE)
    watch.hear(0, msgspec.structs.replace(said, covariance=(-1e-18, *said.covariance[1:])))
    assert watch.outside(0, False)


def test_an_estimate_that_sightings_contradict_tells_nothing():
    watch = FenceWatch(FENCE)
    watch.hear(0, estimate((4.0, 0.0, 1.2), contradicted=True))
    assert not watch.outside(0, False)
    watch.hear(0, estimate((4.0, 0.0, 1.2)))
    watch.hear(200 * MS, estimate(INSIDE, contradicted=True))
    assert watch.outside(300 * MS, False) and not watch.outside(301 * MS, False)


def test_without_a_fence_nobody_is_outside():
    watch = FenceWatch(None)
    watch.hear(0, estimate((40.0, 0.0, 1.2)))
    assert not watch.outside(0, False)


def test_an_estimate_that_is_no_vehicles_is_ignored():
    watch = FenceWatch(FENCE)
    watch.hear(0, msgspec.structs.replace(estimate((4.0, 0.0, 1.2)), mean=(4.0, 0.0), covariance=(0.0,) * 4))
    watch.hear(0, msgspec.structs.replace(estimate((4.0, 0.0, 1.2)), velocity_m_s=(0.0, 0.0)))
    assert not watch.outside(0, False)
