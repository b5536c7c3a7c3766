"""Limits of the output limiter: speed, fence, and separation of robots."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from groundstation.arrays import Array
from groundstation.control.flight_mode import FlightMode
from groundstation.control.output_limiter import limit_setpoint
from groundstation.control.parameters import SafetyParameters
from groundstation.control.setpoints import Setpoint
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, StateLayout
from groundstation.geometry.stabilized_frame import world_from_stabilized
from groundstation.planning.parameters import MotionLimits

SAFETY = SafetyParameters(fence=((-3.7, 3.7), (-2.7, 2.7), (0.0, 2.8)))
LAYOUT = StateLayout().with_entity("a", EntityKind.ROBOT, ROBOT_CORE).with_entity("b", EntityKind.ROBOT, ROBOT_CORE)
LAG_S = 0.5

place = st.tuples(st.floats(-3.6, 3.6), st.floats(-2.6, 2.6), st.floats(0.1, 2.7), st.floats(-3.1, 3.1))
command = st.tuples(*[st.floats(-2, 2)] * 4)


def setpoint(command: tuple[float, float, float, float]) -> Setpoint:
    return Setpoint(command[:3], command[3], FlightMode.TRACK)


def belief(poses: Array, std: float = 0.03) -> JointBelief:
    return JointBelief(poses.ravel(), std**2 * np.eye(8), LAYOUT, 0)


def stop_at_rest(states: Array, velocities: Array, seconds: float, commands: Array, known: bool) -> list[Array]:
    """Fly two robots with velocity lag under constant wishes through the limiter; returns their places."""
    dt, trail = 0.05, []
    for _ in range(round(seconds / dt)):
        at = belief(states)
        speeds = {n: world_from_stabilized(v, s[3]) for n, v, s in zip("ab", velocities, states, strict=True)}
        for i, name in enumerate("ab"):
            wish = setpoint(tuple(commands[i]))
            limited = limit_setpoint(name, wish, at, 0, SAFETY, speeds if known else None).setpoint
            velocities[i] += dt / LAG_S * (np.array(limited.velocity_m_s) - velocities[i])
            states[i, 3] += dt * limited.yaw_rate_rad_s
        for i in range(2):
            states[i, :3] += dt * world_from_stabilized(velocities[i], states[i, 3])
        trail.append(states[:, :3].copy())
    return trail


@given(place, place, command, st.floats(0.001, 0.5))
@settings(max_examples=60, deadline=None)
def test_output_is_never_above_input_or_limits(
    a: tuple[float, ...], b: tuple[float, ...], wish: tuple[float, float, float, float], std: float
) -> None:
    out = limit_setpoint("a", setpoint(wish), belief(np.array([a, b]), std), 0, SAFETY).setpoint
    speed = math.hypot(*out.velocity_m_s)
    assert speed <= math.hypot(*wish[:3]) + 1e-9
    limits = SAFETY.limits_of("a")
    assert math.hypot(*out.velocity_m_s) <= math.hypot(limits.max_speed_m_s, limits.max_climb_m_s) + 1e-9
    assert abs(out.yaw_rate_rad_s) <= min(abs(wish[3]), limits.max_yaw_rate_rad_s) + 1e-9


@given(place, command, st.booleans())
@example((3.5625, 0.0, 1.0, 2.0), (0.0, 1.0, 0.0, 1.0), False)  # along the fence while turning
@settings(max_examples=25, deadline=None)
def test_the_fence_is_never_crossed(
    start: tuple[float, ...], wish: tuple[float, float, float, float], known: bool
) -> None:
    states = np.array([start, (-30.0, -30.0, 1.0, 0.0)])  # the other one far away
    trail = np.array(stop_at_rest(states, np.zeros((2, 3)), 15.0, np.array([wish, (0, 0, 0, 0)]), known))
    for axis, (low, high) in enumerate(SAFETY.fence):
        assert trail[:, 0, axis].min() >= low
        assert trail[:, 0, axis].max() <= high


@given(st.floats(-3.1, 3.1), st.floats(0.9, 3.0), st.floats(-0.6, 0.6), st.floats(-0.3, 0.3), st.booleans())
@settings(max_examples=25, deadline=None)
def test_two_drones_flown_at_each_other_keep_the_separation(
    bearing: float, distance: float, aside: float, turn: float, known: bool
) -> None:
    half = 0.5 * distance * np.array([math.cos(bearing), math.sin(bearing)])
    states = np.array([[*half, 1.4, bearing + math.pi], [*-half, 1.4, bearing]])
    commands = np.array([(0.6, aside, 0.0, turn), (0.6, aside, 0.0, turn)])
    trail = stop_at_rest(states, np.zeros((2, 3)), 12.0, commands, known)
    assert min(float(np.linalg.norm(p[0] - p[1])) for p in trail) >= SAFETY.min_separation_m


@given(
    st.one_of(st.just(0.0), st.floats(-12, 0.2).map(lambda power: 10.0**power)),
    st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: math.hypot(*v) > 0.1),
    command,
    st.booleans(),
)
@example(0.0, (1.0, 0.0, 0.0), (0.6, 0.0, 0.0, 0.0), False)
@example(1e-7, (1.0, 0.0, 0.0), (0.6, 0.0, 0.0, 0.0), True)
@settings(max_examples=60, deadline=None)
def test_nobody_closes_in_however_near_the_other_is_believed(
    distance: float, towards: tuple[float, float, float], wish: tuple[float, float, float, float], known: bool
) -> None:
    direction = np.array(towards) / math.hypot(*towards)
    poses = np.array([[0.0, 0.0, 1.4, 0.0], [*(np.array([0.0, 0.0, 1.4]) + distance * direction), 0.0]])
    speeds = dict.fromkeys("ab", np.zeros(3)) if known else None
    for name, sign in (("a", 1), ("b", -1)):
        limited = limit_setpoint(name, setpoint(wish), belief(poses), 0, SAFETY, speeds)
        velocity = np.array(limited.setpoint.velocity_m_s)
        share_m_s = max(0.0, distance - SAFETY.min_separation_m) / (4.0 * SAFETY.reaction_s)
        assert float(velocity @ direction) * sign <= share_m_s + 1e-6
        if distance < 0.05:  # centres of two bodies cannot be so near: the other may be on any side
            assert limited.limited_by == ("separation",)
            assert not velocity.any() and limited.setpoint.yaw_rate_rad_s == 0.0


def test_points_of_rest_that_coincide_open_no_way() -> None:
    poses = np.array([[0.0, 0.0, 1.4, 0.0], [1.5, 0.0, 1.4, math.pi]])
    speeds = {"a": np.array([1.5, 0.0, 0.0]), "b": np.array([-1.5, 0.0, 0.0])}
    for name in "ab":
        limited = limit_setpoint(name, setpoint((0.5, 0.1, 0.0, 0.0)), belief(poses), 0, SAFETY, speeds)
        assert limited.setpoint.velocity_m_s == pytest.approx((0.0, 0.1, 0.0))
        assert "separation" in limited.limited_by


def flight_apart(places: Array, velocities: Array, limited: bool) -> float:
    """Fly two robots that both want straight away from each other; return their least distance [m]."""
    dt, places, velocities = 0.05, places.copy(), velocities.copy()
    safety = replace(SAFETY, fence=((-9.0, 9.0),) * 3, limits=dict.fromkeys("ab", MotionLimits(1.5, 1.5, 1.0)))
    least = math.inf
    for _ in range(40):
        apart = places[1] - places[0]
        least = min(least, float(np.linalg.norm(apart)))
        away = -0.9 * apart / np.linalg.norm(apart)
        at = belief(np.column_stack((places, np.zeros(2))))
        known, drifts = dict(zip("ab", velocities.copy(), strict=True)), dict.fromkeys("ab", np.zeros(3))
        for i, (name, wish) in enumerate((("a", away), ("b", -away))):
            if limited:
                told = limit_setpoint(name, setpoint((*wish.tolist(), 0.0)), at, 0, safety, known, drifts).setpoint
                wish = np.array(told.velocity_m_s)
            velocities[i] += dt / LAG_S * (wish - velocities[i])
        places += dt * velocities
    return least


@given(
    st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: math.hypot(*v) > 0.1),
    st.floats(0.65, 2.0), st.floats(0.0, 1.4), st.floats(0.0, 1.4), st.tuples(*[st.floats(-0.2, 0.2)] * 3),
)  # fmt: skip
@example((1.0, 0.0, 0.0), 1.0, 1.2, 1.2, (0.0, 0.0, 0.0))  # their points of rest have passed each other
@example((1.0, 0.0, 0.0), 1.0, 0.0, 1.4, (0.0, 0.0, 0.0))
@settings(max_examples=60, deadline=None)
def test_two_that_fly_apart_come_no_nearer_than_their_braking_takes(
    towards: tuple[float, float, float], distance: float, fast: float, other: float, aside: tuple[float, float, float]
) -> None:
    direction = np.array(towards) / math.hypot(*towards)
    places = np.array((0.0, 0.0, 1.4)) + np.outer((-0.5, 0.5), distance * direction)
    velocities = np.outer((fast, -other), direction) + np.outer((0.5, -0.5), aside)
    taken = flight_apart(places, velocities, limited=False)
    assert flight_apart(places, velocities, limited=True) >= taken - 0.01


def test_one_above_the_other_does_not_descend_onto_it() -> None:
    states = np.array([[0.0, 0.0, 2.5, 0.0], [0.05, 0.0, 1.0, 0.0]])
    trail = stop_at_rest(states, np.zeros((2, 3)), 15.0, np.array([(0, 0, -0.4, 0), (0, 0, 0.0, 0)]), known=True)
    assert float(np.linalg.norm(trail[-1][0] - trail[-1][1])) >= SAFETY.min_separation_m


POSES = np.array([[0.0, 0.0, 1.3, 0.0], [2.0, 0.0, 1.3, 0.0]])
WISH = Setpoint((0.3, 0.1, 0.1), 0.2, FlightMode.TRACK)


def test_an_open_way_changes_nothing() -> None:
    limited = limit_setpoint("a", WISH, belief(POSES), 0, SAFETY)
    assert limited.limited_by == ()
    assert limited.setpoint.velocity_m_s == pytest.approx(WISH.velocity_m_s)


@pytest.mark.parametrize(
    ("reason", "now_s", "std", "wish"),
    [
        ("stale", 0.4, 0.03, WISH),
        ("stale", -1.0, 0.03, WISH),
        ("uncertain", 0.0, 0.7, WISH),
        ("not finite", 0.0, 0.03, replace(WISH, yaw_rate_rad_s=math.nan)),
        ("not finite", 0.0, 0.03, replace(WISH, velocity_m_s=(0.1, math.inf, 0.0))),
    ],
)
def test_unfit_beliefs_and_setpoints_become_a_hover_with_a_reason(
    reason: str, now_s: float, std: float, wish: Setpoint
) -> None:
    limited = limit_setpoint("a", wish, belief(POSES, std), round(now_s * 1e9), SAFETY)
    assert limited.limited_by == (reason,)
    assert limited.setpoint.velocity_m_s == (0.0, 0.0, 0.0)
    assert limited.setpoint.yaw_rate_rad_s == 0.0


@pytest.mark.parametrize("bearing", np.linspace(-3.0, 3.0, 13))
def test_full_speed_is_left_whole_in_every_direction(bearing: float) -> None:
    far = belief(np.array([[0.0, 0.0, 1.3, 0.7], [2.5, 2.0, 1.3, 0.0]]))
    told = limit_setpoint("a", setpoint((1.0 * math.cos(bearing), 1.0 * math.sin(bearing), 0.0, 0.0)), far, 0, SAFETY)
    assert told.setpoint.velocity_m_s[:2] == pytest.approx((0.6 * math.cos(bearing), 0.6 * math.sin(bearing)))


def test_a_stranger_hovers() -> None:
    assert limit_setpoint("c", WISH, belief(POSES), 0, SAFETY).limited_by == ("unknown",)


@pytest.mark.parametrize(
    ("name", "poses", "wish"),
    [
        ("speed", POSES, (1.0, 0.0, 0.0, 0.0)),
        ("climb", POSES, (0.0, 0.0, -1.0, 0.0)),
        ("yaw rate", POSES, (0.0, 0.0, 0.0, -3.0)),
        ("fence", np.add(POSES, (3.5, 0, 0, 0)), (0.5, 0.0, 0.0, 0.0)),
        ("separation", np.array([[0, 0, 1.3, 0], [0.9, 0, 1.3, 0]]), (0.5, 0.0, 0.0, 0.0)),
    ],
)
def test_each_limit_is_named(name: str, poses: Array, wish: tuple[float, float, float, float]) -> None:
    assert name in limit_setpoint("a", setpoint(wish), belief(np.array(poses)), 0, SAFETY).limited_by


def test_leaving_fence_and_neighbour_behind_is_free() -> None:
    outside = belief(np.array([[3.9, 0.0, 1.3, 0.0], [4.3, 0.0, 1.3, 0.0]]))
    back = limit_setpoint("a", setpoint((-0.4, 0.0, 0.0, 0.0)), outside, 0, SAFETY)
    assert back.limited_by == ()
    assert back.setpoint.velocity_m_s[0] == pytest.approx(-0.4)
