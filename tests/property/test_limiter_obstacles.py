"""Robots keep away from obstacles whatever they are told: beside a pillar, over a table, and against a drift."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from team_states import CLUTTERED, PILLAR, TABLE

from groundstation.arrays import Array
from groundstation.control.drift import DriftWatch
from groundstation.control.flight_mode import FlightMode
from groundstation.control.output_limiter import Limited, limit_setpoint
from groundstation.control.setpoints import Setpoint
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, StateLayout
from groundstation.sensing.models import Box

LAYOUT = StateLayout().with_entity("a", EntityKind.ROBOT, ROBOT_CORE)
BODY_M = 0.3  # the half of the least separation
STD_M = 0.03


def told(place: Array, wish: Array, velocity: Array, drift: Array | None = None, now_ns: int = 0) -> Limited:
    at = JointBelief(np.append(place, 0.0), STD_M**2 * np.eye(4), LAYOUT, now_ns)
    x, y, z = wish.tolist()
    drifts = None if drift is None else {"a": drift}
    setpoint = Setpoint((x, y, z), 0.0, FlightMode.TRACK)
    return limit_setpoint("a", setpoint, at, now_ns, CLUTTERED, {"a": velocity}, drifts)


def flown(begin: tuple[float, float, float], wishes: Array, drift: Array, lag_s: float) -> Array:
    """Fly wishes [n, 3], each for 1 s, with a lag and an unreported drift; returns the places at 20 Hz."""
    dt, place, velocity, watch = 0.05, np.array(begin), np.zeros(3), DriftWatch()
    places = []
    for step in range(20 * len(wishes)):
        now_ns = 1 + round(step * dt * 1e9)
        known = watch.see(now_ns, place + CLUTTERED.reaction_s * velocity)
        asked = np.array(told(place, wishes[step // 20], velocity, known, now_ns).setpoint.velocity_m_s)
        watch.note_command(asked)
        velocity = velocity + dt / lag_s * (asked - velocity)
        place = place + dt * (velocity + drift)
        places.append(place)
    return np.array(places)


def beside(box: Box) -> st.SearchStrategy[tuple[float, float, float]]:
    """Return places around and above a box, in the fence and at least 0.5 m from it."""
    (x, y), (length, width, _) = box.centre_m, box.size_m
    around = st.tuples(
        st.floats(max(-3.4, x - length / 2 - 1.0), min(3.4, x + length / 2 + 1.0)),
        st.floats(max(-2.4, y - width / 2 - 1.0), min(2.4, y + width / 2 + 1.0)), st.floats(0.4, 2.4),
    )  # fmt: skip
    return around.filter(lambda place: bool(box.distances_m(np.array([place]))[0] > 0.55))


@pytest.mark.parametrize("box", [PILLAR, TABLE])
@given(st.data())
@settings(max_examples=12, deadline=None)
def test_no_wish_and_no_unreported_drift_brings_a_robot_to_an_obstacle(box: Box, data: st.DataObject) -> None:
    begin, rng = data.draw(beside(box)), np.random.default_rng(data.draw(st.integers(0, 1 << 20)))
    wishes = rng.normal(size=(12, 3)) * (0.6, 0.6, 0.4)
    wishes[::2] = np.array(box.middle_m) - begin
    drift = rng.normal(size=3) * 0.03
    drift *= min(1.0, 0.05 / float(np.linalg.norm(drift)))
    places = flown(begin, wishes, drift, data.draw(st.floats(0.2, 0.5)))
    assert box.distances_m(places).min() >= BODY_M
    for axis, (low, high) in enumerate(CLUTTERED.fence):
        assert low <= places[:, axis].min() and places[:, axis].max() <= high


def test_a_way_past_an_obstacle_is_free() -> None:
    x, y = PILLAR.centre_m
    place = np.array([x, y + 1.2, 1.4])
    found = told(place, np.array([-0.6, 0.0, 0.0]), np.array([-0.6, 0.0, 0.0]))
    assert found.limited_by == () and found.setpoint.velocity_m_s == pytest.approx((-0.6, 0.0, 0.0))


def test_a_robot_before_an_obstacle_slides_along_it() -> None:
    x, y = PILLAR.centre_m
    place = np.array([x - 0.5 * PILLAR.size_m[0] - BODY_M - CLUTTERED.margin_m - 2.0 * STD_M, y, 1.4])
    found = told(place, np.array([0.4, 0.3, 0.0]), np.zeros(3))
    assert found.limited_by == ("obstacle",)
    assert found.setpoint.velocity_m_s == pytest.approx((0.0, 0.3, 0.0), abs=1e-6)


@pytest.mark.parametrize(("height_m", "free"), [(1.5, True), (1.1, False)])
def test_a_high_robot_flies_over_a_table_and_a_low_one_does_not(height_m: float, free: bool) -> None:
    (x, y), (length, _, _) = TABLE.centre_m, TABLE.size_m
    wishes = np.tile((0.5, 0.0, 0.0), (8, 1))
    places = flown((x - length / 2 - 0.6, y, height_m), wishes, np.zeros(3), 0.3)
    assert (places[-1, 0] > x) == free
    assert TABLE.distances_m(places).min() >= BODY_M


def test_over_a_table_no_robot_sinks_to_it() -> None:
    (x, y), (*_, height) = TABLE.centre_m, TABLE.size_m
    places = flown((x, y, 1.6), np.tile((0.0, 0.0, -0.4), (8, 1)), np.zeros(3), 0.3)
    assert height + BODY_M + CLUTTERED.margin_m <= places[:, 2].min() <= height + 0.58


def test_a_robot_that_stands_too_near_may_leave_but_not_come_nearer() -> None:
    x, y = PILLAR.centre_m
    place = np.array([x - 0.5 * PILLAR.size_m[0] - 0.2, y, 1.4])
    assert told(place, np.array([-0.3, 0.0, 0.0]), np.zeros(3)).setpoint.velocity_m_s[0] == pytest.approx(-0.3)
    assert told(place, np.array([0.3, 0.0, 0.2]), np.zeros(3)).setpoint.velocity_m_s == pytest.approx((0.0, 0.0, 0.2))


def test_a_drift_towards_an_obstacle_is_countered() -> None:
    x, y = PILLAR.centre_m
    place = np.array([x, y + 0.5 * PILLAR.size_m[1] + BODY_M + CLUTTERED.margin_m + 2.0 * STD_M, 1.4])
    found = told(place, np.zeros(3), np.zeros(3), np.array([0.0, -0.1, 0.0]))
    assert found.setpoint.velocity_m_s == pytest.approx((0.0, 0.15, 0.0))
    assert math.isclose(PILLAR.distances_m(place[None])[0], BODY_M + CLUTTERED.margin_m + 2.0 * STD_M)
