"""Random states of a team for the output limiter, and the half-spaces that the safety page promises in each."""

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.optimize import linprog

from groundstation.arrays import Array
from groundstation.control.parameters import SafetyParameters
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, StateLayout
from groundstation.planning.parameters import MotionLimits

SAFETY = SafetyParameters(fence=((-3.7, 3.7), (-2.7, 2.7), (0.0, 2.8)))
_FENCE, _LIMITS = np.array(SAFETY.fence), MotionLimits()


def _layout(names: str) -> StateLayout:
    layout = StateLayout()
    for name in names:
        layout = layout.with_entity(name, EntityKind.ROBOT, ROBOT_CORE)
    return layout


_LAYOUTS = {count: _layout("abc"[:count]) for count in (2, 3)}


@dataclass(frozen=True)
class TeamState:
    """A belief, the velocities that are reported, and the drifts that are known [m/s; world], by robot."""

    belief: JointBelief
    velocities: dict[str, Array]
    drifts: dict[str, Array]

    @property
    def names(self) -> tuple[str, ...]:
        return self.belief.layout.robots


def random_state(rng: np.random.Generator) -> TeamState:
    """Return a state of two or three robots: every second one near another, some outside the fence or speechless."""
    layout = _LAYOUTS[int(rng.integers(2, 4))]
    names = layout.robots
    places = [rng.uniform(_FENCE[:, 0] - 0.1, _FENCE[:, 1] + 0.1)]
    for _ in names[1:]:
        near = rng.random() < 0.5
        places.append(places[-1] + _anywhere(rng, rng.uniform(0.1, 1.6)) if near else rng.uniform(*_FENCE.T))
    poses = np.column_stack((places, rng.uniform(-math.pi, math.pi, len(names))))
    factor = rng.normal(size=(poses.size, poses.size)) * rng.choice((0.003, 0.03, 0.1))
    belief = JointBelief(poses.ravel(), factor @ factor.T + 1e-6 * np.eye(poses.size), layout, 0)
    velocities = {name: rng.normal(size=3) * (0.4, 0.4, 0.15) for name in names if rng.random() < 0.85}
    drifts = {name: _anywhere(rng, rng.uniform(0.0, SAFETY.most_drift_m_s)) for name in names if rng.random() < 0.85}
    return TeamState(belief, velocities, drifts)


def _anywhere(rng: np.random.Generator, size: float) -> Array:
    """Return a vector of a size in a random direction."""
    direction = rng.normal(size=3)
    return direction * (size / np.linalg.norm(direction))


def random_wish(rng: np.random.Generator, state: TeamState, robot: str) -> tuple[Array, float]:
    """Return what a plan may ask: a velocity [world], half of them at another robot, and a yaw rate [rad/s]."""
    wish = rng.normal(size=3) * (0.5, 0.5, 0.3)
    if rng.random() < 0.5:
        other = rng.choice([name for name in state.names if name != robot])
        gap = state.belief.mean_of(other)[:3] - state.belief.mean_of(robot)[:3]
        wish = gap / np.linalg.norm(gap) * rng.uniform(0.0, 1.0)
    return wish, float(rng.normal() * 0.8) if rng.random() < 0.5 else 0.0


def promised(state: TeamState, robot: str, yaw_rate: float) -> tuple[Array, Array]:
    """Return the half-spaces of the safety page (why it holds): normals [m, 3] and the most along each [m/s].

    They leave room for the drift, and hold for a velocity as it is sent and as the vehicle carries it along when it
    turns, v + T yaw_rate (z x v).
    """
    normals, barriers, times = (
        np.concatenate(parts) for parts in zip(_fence(state, robot), _pairs(state, robot), strict=True)
    )
    most = np.maximum(barriers, 0.0) / times
    if robot in state.drifts:
        known = np.maximum(normals @ state.drifts[robot], 0.0)
        most = most - np.minimum(SAFETY.drift_m_s + known, SAFETY.most_drift_m_s)
    turn = SAFETY.reaction_s * yaw_rate * np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    return np.concatenate((normals, normals + normals @ turn)), np.concatenate((most, most))


def _rest(state: TeamState, robot: str) -> tuple[Array, float]:
    """Return the point of rest, and the time in which a barrier may be used up."""
    place, T = state.belief.mean_of(robot)[:3], SAFETY.reaction_s
    if robot not in state.velocities:
        return place, 3.0 * T
    return place + T * state.velocities[robot], 2.0 * T


def _fence(state: TeamState, robot: str) -> tuple[Array, Array, Array]:
    rest, time_s = _rest(state, robot)
    kept = SAFETY.margin_m + SAFETY.sigmas * np.sqrt(np.diag(state.belief.covariance_of(robot))[:3])
    barriers = np.concatenate((_FENCE[:, 1] - kept - rest, rest - _FENCE[:, 0] - kept))
    return np.concatenate((np.eye(3), -np.eye(3))), barriers, np.full(6, time_s)


def _pairs(state: TeamState, robot: str) -> tuple[Array, Array, Array]:
    """Return two rows for each other robot, at the points of rest and at the places, with half the speed for each."""
    rows, (rest, time_s) = [], _rest(state, robot)
    for other in (name for name in state.names if name != robot):
        there, its_time_s = _rest(state, other)
        apart = state.belief.mean_of(other)[:3] - state.belief.mean_of(robot)[:3]
        for gap in (there - rest, apart):
            normal = gap / np.linalg.norm(gap)
            kept = SAFETY.min_separation_m + SAFETY.margin_m + SAFETY.sigmas * _spread(state, robot, other, normal)
            rows.append((normal, np.linalg.norm(gap) - kept, 2.0 * max(time_s, its_time_s)))
    normals, barriers, times = zip(*rows, strict=True)
    return np.array(normals), np.array(barriers), np.array(times)


def _spread(state: TeamState, robot: str, other: str, normal: Array) -> float:
    """Return the deviation of the way between two robots along a direction [m]."""
    layout, difference = state.belief.layout, np.zeros(len(state.belief.mean))
    difference[layout.block(other).start :][:3] = normal
    difference[layout.block(robot).start :][:3] = -normal
    return math.sqrt(float(difference @ state.belief.covariance @ difference))


def anything_allowed(normals: Array, most: Array) -> bool:
    """Return whether some velocity well within a vehicle's limits satisfies all half-spaces.

    By a linear program, which is not how the limiter finds out.
    """
    across, climb = 0.95 * _LIMITS.max_speed_m_s / math.sqrt(2.0), 0.95 * _LIMITS.max_climb_m_s
    bounds = [(-across, across), (-across, across), (-climb, climb)]
    return bool(linprog(np.zeros(3), normals, most, bounds=bounds).status == 0)


def nearest_gap_m(state: TeamState) -> float:
    """Return the least distance between two robots of the belief."""
    places = [state.belief.mean_of(name)[:3] for name in state.names]
    return min(float(np.linalg.norm(b - a)) for a, b in combinations(places, 2))
