"""Conditions under which other drones may be in the air while a drone climbs from its pad."""

import itertools
import math

import pytest

from drivers.neighbours import Neighbours
from groundstation.bus.messages import EntityEstimate, FlightState, Header, VehicleStatus

S = 1_000_000_000
ALOFT = (FlightState.FLYING, FlightState.HOVERING, FlightState.TAKING_OFF, FlightState.LANDING)


def status(name, state, mode="HOVER"):
    return VehicleStatus(header=Header(0, "here", name, name, 0), flight_state=state, mode=mode)


def believed(name, x_m, y_m=0.0, std_m=0.02, z_m=1.0, converged=True, velocity_m_s=(0.0, 0.0, 0.0)):
    covariance = tuple(std_m**2 if row == column else 0.0 for row in range(4) for column in range(4))
    return EntityEstimate(name, "robot", (x_m, y_m, z_m, 0.0), covariance, velocity_m_s, converged, 0.1)


def watch(state=FlightState.FLYING, pad_m=(0.0, 0.0), mode="HOVER"):
    neighbours = Neighbours("a", pad_m, 0.6, max_speed_m_s=0.4)
    neighbours.take(status("b", state, mode))
    return neighbours


@pytest.mark.parametrize("state", ALOFT)
def test_somebody_in_the_air_over_the_pad_is_named(state):
    neighbours = watch(state)
    neighbours.see(S, [believed("b", 0.4)])
    assert neighbours.obstacle(S) == "b flies 0.4 m from its pad, at least 0.6 m needed"


def test_distance_counts_from_the_pad_and_in_the_plane():
    neighbours = watch(pad_m=(2.0, 1.0))
    for x_m, y_m in itertools.product((1.5, 3.0), (0.8, 2.0)):
        neighbours.see(S, [believed("b", x_m, y_m)])
        near = math.hypot(x_m - 2.0, y_m - 1.0) < 0.64
        assert bool(neighbours.obstacle(S)) == near


def test_a_doubtful_place_counts_as_nearer():
    neighbours = watch()
    neighbours.see(S, [believed("b", 0.9, std_m=0.1)])
    assert neighbours.obstacle(S) == ""
    neighbours.see(S, [believed("b", 0.9, std_m=0.2)])
    assert neighbours.obstacle(S)


def test_a_flying_neighbour_without_position_prevents_take_off():
    neighbours = watch()
    assert neighbours.obstacle(S) == "b is in the air, and nobody knows where"
    neighbours.see(S, [believed("b", 3.0)])
    assert neighbours.obstacle(S) == "" == neighbours.obstacle(2 * S)
    assert neighbours.obstacle(2 * S + 1)
    neighbours.see(3 * S, [believed("b", 3.0)])
    neighbours.take(status("b", FlightState.LOST))
    assert neighbours.obstacle(3 * S) == "" and neighbours.obstacle(5 * S)
    neighbours.take(status("b", FlightState.UNKNOWN))  # a driver that was started again
    assert neighbours.obstacle(5 * S)


@pytest.mark.parametrize("state", [FlightState.LANDED, FlightState.EMERGENCY])
def test_a_standing_neighbour_is_no_obstacle(state):
    neighbours = watch()
    neighbours.take(status("b", state))
    neighbours.take(status("a", FlightState.FLYING))
    assert neighbours.obstacle(S) == ""


def test_without_a_pad_nothing_is_near():
    assert watch(pad_m=None).obstacle(S) == ""


@pytest.mark.parametrize(("std_m", "held"), [((0.2, 0.0), True), ((0.0, 0.2), True), ((0.0, 0.0, 0.5, 0.5), False)])
def test_doubt_counts_by_two_deviations_of_the_worse_axis_of_the_plane(std_m, held):
    variances = [value**2 for value in (*std_m, 0.0, 0.0)][:4]
    covariance = tuple(variances[row] if row == column else 0.0 for row in range(4) for column in range(4))
    neighbours = watch()
    neighbours.see(S, [EntityEstimate("b", "robot", (0.98, 0.0, 1.0, 0.0), covariance, (0.0,) * 3, True, 0.1)])
    assert bool(neighbours.obstacle(S)) == held
    neighbours.see(S, [EntityEstimate("b", "robot", (1.02, 0.0, 1.0, 0.0), covariance, (0.0,) * 3, True, 0.1)])
    assert neighbours.obstacle(S) == ""


def test_the_separation_itself_is_far_enough():
    neighbours = watch()
    neighbours.see(S, [believed("b", 0.6, std_m=0.0)])
    assert neighbours.obstacle(S) == ""


@pytest.mark.parametrize("mode", ["HOVER", "HOLD", "LANDING", "CONNECTING"])
@pytest.mark.parametrize(("towards_m_s", "least_m"), [(0.0, 0.6), (0.4, 0.8), (-0.4, 0.6)])
def test_one_that_comes_towards_the_pad_needs_its_lag_to_stop(mode, towards_m_s, least_m):
    neighbours = watch(mode=mode)
    for x_m, held in ((least_m - 0.01, True), (least_m + 0.01, False)):
        neighbours.see(S, [believed("b", x_m, std_m=0.0, velocity_m_s=(-towards_m_s, 0.3, 0.0))])
        assert bool(neighbours.obstacle(S)) == held


@pytest.mark.parametrize("bearing", [0.4, 2.0, 3.5, 5.0])
def test_it_may_come_from_any_side(bearing):
    neighbours, c, s = watch(pad_m=(2.0, 1.0)), math.cos(bearing), math.sin(bearing)
    for distance_m, held in ((0.79, True), (0.81, False)):
        velocity_m_s = (-0.4 * c - 0.2 * s, -0.4 * s + 0.2 * c, 0.3)
        place = (2.0 + distance_m * c, 1.0 + distance_m * s)
        neighbours.see(S, [believed("b", *place, std_m=0.0, velocity_m_s=velocity_m_s)])
        assert bool(neighbours.obstacle(S)) == held


def test_one_right_over_the_pad_is_too_near():
    neighbours = watch()
    neighbours.see(S, [believed("b", 0.0, velocity_m_s=(0.4, 0.0, 0.0))])
    assert neighbours.obstacle(S)


@pytest.mark.parametrize(("towards_m_s", "least_m"), [(0.0, 0.81), (0.4, 1.01)])
def test_one_that_tracks_may_still_be_told_to_fly_there(towards_m_s, least_m):
    neighbours = watch(mode="TRACK")
    for x_m, held in ((least_m - 0.01, True), (least_m + 0.01, False)):
        neighbours.see(S, [believed("b", x_m, std_m=0.0, velocity_m_s=(-towards_m_s, 0.0, 0.0))])
        assert bool(neighbours.obstacle(S)) == held
    neighbours.take(status("b", FlightState.FLYING, "HOLD"))
    neighbours.see(S, [believed("b", 0.61, std_m=0.0)])
    assert neighbours.obstacle(S) == ""


def aloft(*entities):
    """Return the warnings of a and b about each other, with both in the air."""
    both = []
    for name in "ab":
        neighbours = Neighbours(name, None, 0.6, 0.6)
        for other in "ab":
            neighbours.take(status(other, FlightState.FLYING))
        neighbours.see(S, entities)
        both.append(neighbours)
    return both


def crowded(*entities):
    return tuple(one.crowded(S) for one in aloft(*entities))


def test_of_two_as_high_as_each_other_the_later_one_makes_way():
    assert crowded(believed("a", 0.0), believed("b", 0.4)) == ("", "a flies 0.40 m from it, at least 0.6 m is allowed")


@pytest.mark.parametrize(("a_m", "lands"), [(0.7, "a"), (1.3, "b")])
def test_the_lower_one_makes_way(a_m, lands):
    of_a, of_b = crowded(believed("a", 0.0, z_m=a_m), believed("b", 0.2))
    assert (bool(of_a), bool(of_b)) == (lands == "a", lands == "b")


def test_only_what_is_surely_too_near_counts():
    assert not any(crowded(believed("a", 0.0), believed("b", 0.56)))
    assert not any(crowded(believed("a", 0.0), believed("b", 0.4, std_m=0.12)))
    assert not any(crowded(believed("a", 0.0), believed("b", 0.2, converged=False)))
    assert not any(crowded(believed("a", 0.0), believed("b", 0.3, z_m=1.6)))


@pytest.mark.parametrize(("z_m", "makes_way"), [(1.19, True), (1.21, False)])
def test_heights_within_two_decimetres_are_the_same(z_m, makes_way):
    _, of_b = crowded(believed("a", 0.0, z_m=1.0), believed("b", 0.1, z_m=z_m))
    assert bool(of_b) == makes_way


@pytest.mark.parametrize(("later_ms", "known"), [(290, True), (310, False)])
def test_a_place_counts_for_three_tenths_of_a_second(later_ms, known):
    _, b = aloft(believed("a", 0.0), believed("b", 0.4))
    assert (b.crowded(S + later_ms * S // 1000) != "") == known


def test_drones_far_apart_give_no_separation_warning():
    assert crowded(believed("a", 0.0), believed("b", 2.0)) == ("", "")
    assert crowded(believed("a", 0.0)) == ("", "")


def test_nobody_makes_way_for_who_lands_or_stands_or_is_not_known():
    _, b = aloft(believed("a", 0.0), believed("b", 0.4))
    assert b.crowded(S) and not b.crowded(S + S // 2)
    b.take(status("a", FlightState.LANDING))
    assert not b.crowded(S)
    b.take(status("a", FlightState.HOVERING))
    assert b.crowded(S)
    b.take(status("a", FlightState.LANDED))
    assert not b.crowded(S)
