"""The output limiter's half-spaces: the nearest velocity; fence and separation kept against an unreported drift.

`make limiter-states` draws ten million states.
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from limiter_judge import Told, judge, judged, limited
from team_states import SAFETY, TeamStates, anything_allowed, promised, random_states

from groundstation.arrays import Array
from groundstation.control.drift import DriftWatch
from groundstation.control.flight_mode import FlightMode
from groundstation.control.half_spaces import project
from groundstation.control.output_limiter import limit_setpoint
from groundstation.control.setpoints import Setpoint
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, StateLayout

Spoiler = Callable[[Told, TeamStates], Told]
LAYOUT = StateLayout().with_entity("a", EntityKind.ROBOT, ROBOT_CORE).with_entity("b", EntityKind.ROBOT, ROBOT_CORE)

# -- the nearest velocity ---------------------------------------------------------------------------------------------


def unit(rng: np.random.Generator, count: int) -> Array:
    rows = rng.normal(size=(count, 3))
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


@pytest.mark.parametrize("walls", [1, 2, 3, 6, 14, 24])
def test_the_returned_velocity_is_the_nearest_allowed_one(walls: int) -> None:
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


def check_states(count: int, seed: int) -> None:
    ends = judged(count, seed)
    # The draws cover the cases to be shown.
    assert ends["held off"] > 0.3 * count and ends["bent"] > 0.1 * count and ends["open"] > 0.2 * count, ends
    assert ends["squeezed"] < 0.1 * count, ends


def test_no_wall_is_approached_too_fast_from_random_states() -> None:
    check_states(600, 1)


@pytest.mark.slow
@pytest.mark.study
def test_no_wall_is_approached_too_fast_from_very_many_random_states() -> None:
    check_states(100_000, 2)


def test_a_batch_of_linear_programs_finds_what_each_alone_finds() -> None:
    states = random_states(np.random.default_rng(5), 300, 3)
    normals, most = promised(states, 0, np.zeros(300))
    alone = [bool(anything_allowed(normals[i : i + 1], most[i : i + 1])) for i in range(300)]
    assert anything_allowed(normals, most).tolist() == alone
    assert 0.02 < 1.0 - np.mean(alone) < 0.5


def _slow_wishes(known_drifts: bool) -> TeamStates:
    """Return states with wishes of 0.3 m/s, and an underestimated drift."""
    states = random_states(np.random.default_rng(6), 200, 2)
    covariances = states.covariances.copy()
    covariances[0] += np.eye(8)
    wishes = 0.3 * states.wishes / np.linalg.norm(states.wishes, axis=2, keepdims=True)
    drifts = states.drifts if known_drifts else np.full_like(states.drifts, np.nan)
    return replace(states, covariances=covariances, wishes=wishes, drifts=drifts)


@pytest.mark.parametrize(
    ("promise", "known_drifts", "spoilt"),
    [
        ("who is unfit hovers", True, lambda told, _: replace(told, yaw_rates=told.yaw_rates + 1e-3)),
        ("limits are kept", True, lambda told, _: replace(told, yaw_rates=9.0 * told.yaw_rates)),
        ("nobody comes nearer", False, lambda told, states: replace(told, velocities=states.wishes)),
        ("what holds off every drift is found", True, lambda told, _: replace(told, velocities=0.0 * told.velocities)),
        ("an open way changes nothing", False, lambda told, _: replace(told, velocities=0.9 * told.velocities)),
        (
            "a step nearer to the wish is allowed", False, lambda told, states: replace(
                told, velocities=np.where(np.isclose(told.velocities, states.wishes), 1.0, 0.9) * told.velocities
            ),
        ),
    ],
)  # fmt: skip
def test_the_judge_sees_each_broken_promise(promise: str, known_drifts: bool, spoilt: Spoiler) -> None:
    states = _slow_wishes(known_drifts)
    told = limited(states)
    judge(states, told, 0)
    wrong = spoilt(told, states)
    if promise == "nobody comes nearer":
        wrong = replace(wrong, velocities=np.where(states.unfit(0)[:, None, None], 0.0, wrong.velocities))
    with pytest.raises(AssertionError, match=promise):
        judge(states, wrong, 0)


# -- over time --------------------------------------------------------------------------------------------------------


def fly_at_each_other(
    lag_s: float, delay_s: float, drift: Array, aside_m_s: float, seconds: float
) -> tuple[Array, Array]:
    """Command two drones to fly at each other under an unreported drift; returns distances and places."""
    dt = 0.05
    poses = np.array([[-1.5, 0.0, 1.4, 0.0], [1.5, 0.2, 1.4, 0.0]])
    moves, wishes = np.zeros((2, 3)), np.array([[0.6, aside_m_s, 0.0], [-0.6, aside_m_s, 0.0]])
    watches, under_way = (DriftWatch(), DriftWatch()), deque([np.zeros((2, 3))] * (1 + round(delay_s / dt)))
    distances, places = [], []
    for step in range(round(seconds / dt)):
        now_ns = 1 + round(step * dt * 1e9)
        at = JointBelief(poses.ravel().copy(), 0.03**2 * np.eye(8), LAYOUT, now_ns)
        said = {n: moves[i] for i, n in enumerate("ab")}  # the reported velocity does not contain the drift
        drifts = {n: watches[i].see(now_ns, poses[i, :3] + SAFETY.reaction_s * moves[i]) for i, n in enumerate("ab")}
        told = np.zeros((2, 3))
        for i, name in enumerate("ab"):
            setpoint = Setpoint(tuple(wishes[i].tolist()), 0.0, FlightMode.TRACK)
            told[i] = limit_setpoint(name, setpoint, at, now_ns, SAFETY, said, drifts).setpoint.velocity_m_s
            watches[i].note_command(told[i])
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
