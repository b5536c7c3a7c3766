"""The output limiter's half-spaces: the nearest velocity, and fence and separation kept against an unsaid drift.

`GROUNDSTATION_LIMITER_STATES=10000000` sets how many states of a robot the slow test draws,
`GROUNDSTATION_LIMITER_SEED` from where on.
"""

import math
import os
from collections import Counter, deque

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from team_states import SAFETY, TeamState, anything_allowed, nearest_gap_m, promised, random_state, random_wish

from groundstation.arrays import Array
from groundstation.control.drift import DriftWatch
from groundstation.control.flight_mode import FlightMode
from groundstation.control.half_spaces import project
from groundstation.control.output_limiter import Limited, limit_setpoint
from groundstation.control.setpoints import Setpoint
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, StateLayout
from groundstation.geometry.stabilized_frame import stabilized_from_world, world_from_stabilized
from groundstation.planning.parameters import MotionLimits

LAYOUT = StateLayout().with_entity("a", EntityKind.ROBOT, ROBOT_CORE).with_entity("b", EntityKind.ROBOT, ROBOT_CORE)
LIMITS = MotionLimits()
STATES = int(os.environ.get("GROUNDSTATION_LIMITER_STATES", "40000"))


# -- the nearest velocity ---------------------------------------------------------------------------------------------


def unit(rng: np.random.Generator, count: int) -> Array:
    rows = rng.normal(size=(count, 3))
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


@pytest.mark.parametrize("walls", [1, 2, 3, 6, 14, 24])
def test_what_is_returned_is_allowed_and_nothing_allowed_is_nearer(walls: int) -> None:
    rng = np.random.default_rng(walls)
    for _ in range(60):
        inside = rng.normal(size=3) * 0.3
        normals = unit(rng, walls)
        most = normals @ inside + rng.exponential(0.1, walls)
        wanted = rng.normal(size=3)
        found, met = project(wanted, normals, most)
        assert (normals @ found - most).max() <= 1e-6
        assert bool(met) is bool((normals @ wanted > most + 1e-6).any())
        others = inside + rng.normal(size=(200, 3)) * 0.3
        allowed = others[(others @ normals.T <= most).all(axis=1)]
        assert ((allowed - found) @ (wanted - found) <= 1e-6).all(), "the supporting plane of the nearest point"


def test_where_nothing_is_allowed_less_is_asked_and_nobody_is_approached() -> None:
    normals = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    found, _ = project(np.array([0.5, 0.5, 0.1]), normals, np.array([-0.2, -0.1, 0.3]))
    assert found == pytest.approx((0.0, 0.3, 0.1), abs=2e-3), "squeezed between two that both push it away"
    one, _ = project(np.array([0.5, 0.0, 0.0]), normals, np.array([-0.2, 0.05, 0.3]))
    assert one == pytest.approx((-0.05, 0.0, 0.0), abs=2e-3), "one pushes, and the other lets it come a little"


# -- one step from any state ------------------------------------------------------------------------------------------


def check(state: TeamState, robot: str, wish: Array, yaw_rate: float) -> str:
    """Assert what is promised of one command: no wall is approached too fast, and drifts are held off where any can be.

    Returns "hovers" (unfit to fly), "held off" or "free": whether a wall asked for motion against a drift; "squeezed":
    the walls ask for more than a vehicle can do.
    """
    limited = command(state, robot, wish, yaw_rate)
    if {"uncertain", "separation"} & set(limited.limited_by) and not any(limited.setpoint.velocity_m_s):
        doubtful = max(np.diag(state.belief.covariance_of(robot))[:3]) > SAFETY.max_position_std_m**2
        if doubtful or nearest_gap_m(state) < 0.1:
            return "hovers"
    yaw, rate = float(state.belief.mean_of(robot)[3]), limited.setpoint.yaw_rate_rad_s
    velocity = world_from_stabilized(np.array(limited.setpoint.velocity_m_s), yaw)
    assert math.hypot(*velocity[:2]) <= LIMITS.max_speed_m_s + 1e-9
    assert abs(velocity[2]) <= LIMITS.max_climb_m_s + 1e-9 and abs(rate) <= LIMITS.max_yaw_rate_rad_s
    normals, most = promised(state, robot, rate)
    excess = normals @ velocity - most
    assert (excess - np.maximum(-most, 0.0)).max() <= 1e-6, "nobody comes nearer than a wall lets it"
    if excess.max() <= 1e-6:
        return "held off" if most.min() < 0.0 else "free"
    assert not anything_allowed(normals, most), "a velocity that holds off every drift is found"
    return "squeezed"


def command(state: TeamState, robot: str, wish: Array, yaw_rate: float) -> Limited:
    yaw = float(state.belief.mean_of(robot)[3])
    setpoint = Setpoint(tuple(stabilized_from_world(wish, yaw).tolist()), yaw_rate, FlightMode.TRACK)
    return limit_setpoint(robot, setpoint, state.belief, 0, SAFETY, state.velocities, state.drifts)


def check_states(count: int, seed: int) -> None:
    rng, ends = np.random.default_rng(seed), Counter[str]()
    while ends.total() < count:
        state = random_state(rng)
        ends.update(check(state, robot, *random_wish(rng, state, robot)) for robot in state.names)
    # The draws reach what is to be shown.
    assert ends["held off"] > 0.3 * count and ends["free"] > 0.2 * count and ends["squeezed"] < 0.1 * count, ends


def test_no_wall_is_approached_too_fast_from_random_states() -> None:
    check_states(600, 1)


@pytest.mark.slow
@pytest.mark.study
@pytest.mark.timeout(36000)
def test_no_wall_is_approached_too_fast_from_very_many_random_states() -> None:
    check_states(STATES, int(os.environ.get("GROUNDSTATION_LIMITER_SEED", "2")))


# -- over time --------------------------------------------------------------------------------------------------------


def fly_at_each_other(
    lag_s: float, delay_s: float, drift: Array, aside_m_s: float, seconds: float
) -> tuple[Array, Array]:
    """Two drones asked to fly at each other, and besides pushed by an unsaid drift; returns distances and places."""
    dt = 0.05
    poses = np.array([[-1.5, 0.0, 1.4, 0.0], [1.5, 0.2, 1.4, 0.0]])
    moves, wishes = np.zeros((2, 3)), np.array([[0.6, aside_m_s, 0.0], [-0.6, aside_m_s, 0.0]])
    watches, under_way = (DriftWatch(), DriftWatch()), deque([np.zeros((2, 3))] * (1 + round(delay_s / dt)))
    distances, places = [], []
    for step in range(round(seconds / dt)):
        now_ns = 1 + round(step * dt * 1e9)
        at = JointBelief(poses.ravel().copy(), 0.03**2 * np.eye(8), LAYOUT, now_ns)
        said = {n: moves[i] for i, n in enumerate("ab")}  # what the drift does is not in what they report
        drifts = {n: watches[i].see(now_ns, poses[i, :3] + SAFETY.reaction_s * moves[i]) for i, n in enumerate("ab")}
        told = np.zeros((2, 3))
        for i, name in enumerate("ab"):
            setpoint = Setpoint(tuple(wishes[i].tolist()), 0.0, FlightMode.TRACK)
            told[i] = limit_setpoint(name, setpoint, at, now_ns, SAFETY, said, drifts).setpoint.velocity_m_s
            watches[i].tell(told[i])
        under_way.append(told)
        moves += dt / lag_s * (under_way.popleft() - moves)
        poses[:, :3] += dt * (moves + np.array([drift, -drift]))
        distances.append(float(np.linalg.norm(poses[1, :3] - poses[0, :3])))
        places.append(poses[:, :3].copy())
    return np.array(distances), np.array(places)


@given(st.floats(0.2, 0.5), st.floats(0.0, 0.15), st.floats(-3.1, 3.1), st.floats(0.0, 0.05), st.floats(-0.3, 0.3))
@settings(max_examples=8, deadline=None)
def test_an_unsaid_drift_brings_nobody_together_or_out(
    lag_s: float, delay_s: float, bearing: float, size: float, aside: float
) -> None:
    drift = size * np.array([math.cos(bearing), math.sin(bearing), 0.0])
    distances, places = fly_at_each_other(lag_s, delay_s, drift, aside, 20.0)
    assert distances.min() >= SAFETY.min_separation_m
    for axis, (low, high) in enumerate(SAFETY.fence):
        assert low <= places[:, :, axis].min() and places[:, :, axis].max() <= high


def test_a_drift_that_is_noticed_is_held_off_though_it_is_larger_than_what_is_always_allowed() -> None:
    distances, _ = fly_at_each_other(0.3, 0.1, np.array([0.12, 0.0, 0.0]), 0.0, 25.0)
    assert distances.min() >= SAFETY.min_separation_m
    assert distances[-100:].min() >= SAFETY.min_separation_m + 0.05, "for ever"
