"""The output limiter's half-spaces: the nearest velocity, and fence and separation kept against an unsaid drift.

`GROUNDSTATION_LIMITER_STATES=10000000` sets how many random states the slow test draws.
"""

import math
import os
from collections import deque

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.arrays import Array
from groundstation.control.drift import DriftWatch
from groundstation.control.flight_mode import FlightMode
from groundstation.control.half_spaces import project
from groundstation.control.output_limiter import limit_setpoint
from groundstation.control.parameters import SafetyParameters
from groundstation.control.setpoints import Setpoint
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, StateLayout
from groundstation.geometry.stabilized_frame import stabilized_from_world, world_from_stabilized

SAFETY = SafetyParameters(fence=((-3.7, 3.7), (-2.7, 2.7), (0.0, 2.8)))
LAYOUT = StateLayout().with_entity("a", EntityKind.ROBOT, ROBOT_CORE).with_entity("b", EntityKind.ROBOT, ROBOT_CORE)
TIME_S = 2.0 * SAFETY.reaction_s
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


def random_state(rng: np.random.Generator) -> tuple[JointBelief, dict[str, Array], dict[str, Array]]:
    """Return a belief with errors that robots share, velocities, and drifts within what is held off."""
    poses = rng.uniform((-3.7, -2.7, 0.0, -3.1), (3.7, 2.7, 2.8, 3.1), (2, 4))
    factor = rng.normal(size=(8, 8)) * rng.choice((0.003, 0.03, 0.1))
    covariance = factor @ factor.T + 1e-6 * np.eye(8)
    velocities = dict(zip("ab", rng.normal(size=(2, 3)) * (0.4, 0.4, 0.15), strict=True))
    pushes = rng.normal(size=(2, 3)) * 0.05
    pushes *= np.minimum(1.0, SAFETY.most_drift_m_s / np.linalg.norm(pushes, axis=1, keepdims=True))
    drifts = dict(zip("ab", pushes, strict=True))
    return JointBelief(poses.ravel(), covariance, LAYOUT, 0), velocities, drifts


def sent(robot: str, wish: Array, at: JointBelief, velocities: dict[str, Array], drifts: dict[str, Array]) -> Array:
    """Return the velocity that is sent [world]."""
    yaw = float(at.mean_of(robot)[3])
    setpoint = Setpoint(tuple(stabilized_from_world(wish, yaw).tolist()), 0.0, FlightMode.TRACK)
    limited = limit_setpoint(robot, setpoint, at, 0, SAFETY, velocities, drifts)
    return world_from_stabilized(np.array(limited.setpoint.velocity_m_s), yaw)


def separation_kept(at: JointBelief, velocities: dict[str, Array], normal: Array) -> float:
    P = at.covariance
    relative = P[:3, :3] + P[4:7, 4:7] - P[:3, 4:7] - P[4:7, :3]
    return SAFETY.min_separation_m + SAFETY.margin_m + SAFETY.sigmas * math.sqrt(float(normal @ relative @ normal))


def check_states(count: int, seed: int) -> None:
    """From any state in which nobody is squeezed, no barrier falls faster than by 1 / time, whatever the drift."""
    rng, checked = np.random.default_rng(seed), 0
    for _ in range(count):
        at, velocities, drifts = random_state(rng)
        rests = {name: at.mean_of(name)[:3] + SAFETY.reaction_s * velocities[name] for name in "ab"}
        told = {n: sent(n, rng.normal(size=3) * (0.5, 0.5, 0.3), at, velocities, drifts) for n in "ab"}
        if not all(command.any() for command in told.values()):
            continue  # hovers for another reason
        gap = rests["b"] - rests["a"]
        distance = float(np.linalg.norm(gap))
        normal = gap / distance
        barrier = distance - separation_kept(at, velocities, normal)
        falls = float(normal @ (told["a"] + drifts["a"] - told["b"] - drifts["b"]))
        inside = all(
            low + 0.7 < rest[axis] < high - 0.7
            for axis, (low, high) in enumerate(SAFETY.fence)
            for rest in rests.values()
        )
        if inside and float(np.linalg.norm(at.mean_of("b")[:3] - at.mean_of("a")[:3])) > 1.2:
            assert falls <= max(0.0, barrier) / TIME_S + 1e-6
            checked += 1
        spread = np.sqrt(np.diag(at.covariance_of("a"))[:3])
        for axis, (low, high) in enumerate(SAFETY.fence):
            keep = SAFETY.margin_m + SAFETY.sigmas * spread[axis]
            if float(np.linalg.norm(told["a"])) < 0.05:
                continue  # squeezed: walls ask for opposite motions, and it brakes
            if barrier < 0.3 or min(high - rests["a"][axis], rests["a"][axis] - low) < keep:
                continue
            moves = told["a"][axis] + drifts["a"][axis]
            assert (
                -(rests["a"][axis] - low - keep) / TIME_S - 1e-6
                <= moves
                <= (high - keep - rests["a"][axis]) / TIME_S + 1e-6
            )
    assert checked >= 0.02 * count


def test_no_barrier_falls_too_fast_from_random_states() -> None:
    check_states(600, 1)


@pytest.mark.slow
def test_no_barrier_falls_too_fast_from_very_many_random_states() -> None:
    check_states(STATES, 2)


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
