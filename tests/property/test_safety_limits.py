"""The last word: never faster than asked or allowed, never through the fence, never into each other."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from groundstation.control.frames import world_from_stabilized
from groundstation.control.modes import Phase
from groundstation.control.parameters import SafetyParameters
from groundstation.control.safety import limit_setpoint
from groundstation.control.setpoints import Setpoint
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, Layout

Array = NDArray[np.float64]

SAFETY = SafetyParameters(fence=((-3.7, 3.7), (-2.7, 2.7), (0.0, 2.8)))
LAYOUT = Layout().with_entity("a", EntityKind.ROBOT, ROBOT_CORE).with_entity("b", EntityKind.ROBOT, ROBOT_CORE)
LAG_S = 0.5

place = st.tuples(st.floats(-3.6, 3.6), st.floats(-2.6, 2.6), st.floats(0.1, 2.7), st.floats(-3.1, 3.1))
command = st.tuples(*[st.floats(-2, 2)] * 4)


def setpoint(command: tuple[float, float, float, float]) -> Setpoint:
    return Setpoint(command[:3], command[3], Phase.TRACK)


def belief(poses: Array, std: float = 0.03) -> JointBelief:
    return JointBelief(poses.ravel(), std**2 * np.eye(8), LAYOUT, 0)


def stop_at_rest(states: Array, velocities: Array, seconds: float, commands: Array, known: bool) -> list[Array]:
    """Fly two robots with velocity lag under constant wishes through the last word; returns their places."""
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


def test_one_above_the_other_does_not_descend_onto_it() -> None:
    states = np.array([[0.0, 0.0, 2.5, 0.0], [0.05, 0.0, 1.0, 0.0]])
    trail = stop_at_rest(states, np.zeros((2, 3)), 15.0, np.array([(0, 0, -0.4, 0), (0, 0, 0.0, 0)]), known=True)
    assert float(np.linalg.norm(trail[-1][0] - trail[-1][1])) >= SAFETY.min_separation_m


POSES = np.array([[0.0, 0.0, 1.3, 0.0], [2.0, 0.0, 1.3, 0.0]])
WISH = Setpoint((0.3, 0.1, 0.1), 0.2, Phase.TRACK)


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
def test_what_is_unfit_hovers_and_says_why(reason: str, now_s: float, std: float, wish: Setpoint) -> None:
    limited = limit_setpoint("a", wish, belief(POSES, std), round(now_s * 1e9), SAFETY)
    assert limited.limited_by == (reason,)
    assert limited.setpoint.velocity_m_s == (0.0, 0.0, 0.0)
    assert limited.setpoint.yaw_rate_rad_s == 0.0


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
