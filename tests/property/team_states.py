"""Random states of teams for the output limiter, and the half-spaces that the safety page promises in each.

Many states at a time, as arrays: drawing and judging one takes a tenth of the limiter's time.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import block_diag

from groundstation.arrays import Array, BoolArray
from groundstation.control.parameters import SafetyParameters
from groundstation.control.shafts import Shaft
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, StateLayout
from groundstation.planning.parameters import MotionLimits
from groundstation.sensing.models import Box

PILLAR, TABLE = Box((2.4, -1.5), (0.4, 0.3, 2.8)), Box((-2.4, 1.6), (0.8, 0.6, 0.75))
SAFETY = SafetyParameters(fence=((-3.7, 3.7), (-2.7, 2.7), (0.0, 2.8)))
CLUTTERED = replace(SAFETY, obstacles=(PILLAR, TABLE))
LIMITS = MotionLimits()
_FENCE = np.array(SAFETY.fence)
_SAID = 0.85  # share of robots with a reported velocity, and of those with a known drift
# Many linear programs are combined to one with blocks; with more blocks each takes longer.
_PROGRAMS = 200
_MET_M_S = 1e-8


def _layout(names: str) -> StateLayout:
    layout = StateLayout()
    for name in names:
        layout = layout.with_entity(name, EntityKind.ROBOT, ROBOT_CORE)
    return layout


_LAYOUTS = {count: _layout("abc"[:count]) for count in (2, 3)}


@dataclass(frozen=True)
class TeamStates:
    """States of n teams of r robots, and the wish of each robot.

    poses [n, r, 4], covariances [n, 4 r, 4 r]; reported velocities and known drifts [n, r, 3; m/s; world], NaN if
    absent; wishes [n, r, 3; m/s; world], yaw_rates [n, r; rad/s]. shafts [n, 4]: one of another robot in each, x, y,
    variance and drift; NaN if there is none. safety: the limiter's settings, with the obstacles of the room.
    """

    poses: Array
    covariances: Array
    velocities: Array
    drifts: Array
    wishes: Array
    yaw_rates: Array
    shafts: Array
    safety: SafetyParameters = SAFETY

    @property
    def names(self) -> tuple[str, ...]:
        return self._layout.robots

    @property
    def _layout(self) -> StateLayout:
        return _LAYOUTS[self.poses.shape[1]]

    def belief(self, row: int) -> JointBelief:
        return JointBelief(self.poses[row].ravel(), self.covariances[row], self._layout, 0)

    def velocities_of(self, row: int) -> dict[str, Array]:
        return _known(self.names, self.velocities[row])

    def drifts_of(self, row: int) -> dict[str, Array]:
        return _known(self.names, self.drifts[row])

    def shafts_of(self, row: int) -> dict[str, Shaft]:
        return {} if math.isnan(self.shafts[row, 0]) else {"climbing": Shaft(*self.shafts[row].tolist())}

    def rest(self, robot: int) -> tuple[Array, Array]:
        """Return the points of rest [n, 3], and the times within which a barrier may be used up [n]."""
        place, T, velocity = self.poses[:, robot, :3], SAFETY.reaction_s, self.velocities[:, robot]
        speechless = np.isnan(velocity[:, 0])
        return np.where(speechless[:, None], place, place + T * velocity), np.where(speechless, 3.0 * T, 2.0 * T)

    def variances(self, robot: int) -> Array:
        """Return the variances of x, y, z [n, 3; m^2]."""
        return self.covariances.diagonal(axis1=1, axis2=2)[:, 4 * robot : 4 * robot + 3]

    def others(self, robot: int) -> list[int]:
        return [other for other in range(self.poses.shape[1]) if other != robot]

    def unfit(self, robot: int) -> BoolArray:
        """Return where the robot must hover: its belief is too uncertain, or another is believed in its place [n]."""
        gaps = [np.linalg.norm(self.poses[:, k, :3] - self.poses[:, robot, :3], axis=1) for k in self.others(robot)]
        return (self.variances(robot).max(axis=1) > SAFETY.max_position_std_m**2) | (np.min(gaps, axis=0) < 0.1)


def _known(names: tuple[str, ...], values: Array) -> dict[str, Array]:
    return {name: value for name, value in zip(names, values, strict=True) if not math.isnan(value[0])}


def random_states(rng: np.random.Generator, count: int, robots: int, safety: SafetyParameters = SAFETY) -> TeamStates:
    """Return states of teams: every second robot near another, some outside the fence or without reported velocity.

    Half of the wishes lead to another robot, half of them include a turn.
    """
    places = np.empty((count, robots, 3))
    places[:, 0] = rng.uniform(_FENCE[:, 0] - 0.1, _FENCE[:, 1] + 0.1, (count, 3))
    for i in range(1, robots):
        near = places[:, i - 1] + _anywhere(rng, rng.uniform(0.1, 1.6, count))
        places[:, i] = np.where(rng.random((count, 1)) < 0.5, near, rng.uniform(_FENCE[:, 0], _FENCE[:, 1], (count, 3)))
    dim = 4 * robots
    factor = rng.normal(size=(count, dim, dim)) * rng.choice((0.003, 0.03, 0.1), (count, 1, 1))
    drifts = _anywhere(rng, rng.uniform(0.0, SAFETY.most_drift_m_s, (count, robots)))
    velocities = rng.normal(size=(count, robots, 3)) * (0.4, 0.4, 0.15)
    return TeamStates(
        np.concatenate((places, rng.uniform(-math.pi, math.pi, (count, robots, 1))), axis=2),
        factor @ factor.transpose(0, 2, 1) + 1e-6 * np.eye(dim),
        np.where(rng.random((count, robots, 1)) < _SAID, velocities, np.nan),
        np.where(rng.random((count, robots, 1)) < _SAID, drifts, np.nan),
        _wishes(rng, places),
        np.where(rng.random((count, robots)) < 0.5, rng.normal(size=(count, robots)) * 0.8, 0.0),
        _random_shafts(rng, places[:, 0]),
        safety,
    )


def _random_shafts(rng: np.random.Generator, places: Array) -> Array:
    """Return shafts near places [n, 3]; NaN in two of three states."""
    count = len(places)
    near = places[:, :2] + _anywhere(rng, rng.uniform(0.1, 2.0, count))[:, :2]
    more = rng.uniform(0.0, (0.1**2, 0.5), (count, 2))
    return np.where(rng.random((count, 1)) < 1.0 / 3.0, np.concatenate((near, more), axis=1), np.nan)


def _anywhere(rng: np.random.Generator, sizes: Array) -> Array:
    """Return a vector of each size in a random direction [..., 3]."""
    directions = rng.normal(size=(*sizes.shape, 3))
    return directions * (sizes / np.linalg.norm(directions, axis=-1))[..., None]


def _wishes(rng: np.random.Generator, places: Array) -> Array:
    """Return possible requests of plans [n, r, 3]: any velocity, or one towards another robot."""
    count, robots, _ = places.shape
    others = (np.arange(robots) + rng.integers(1, robots, (count, robots))) % robots
    gaps = np.take_along_axis(places, others[..., None], axis=1) - places
    at_another = gaps * (rng.uniform(0.0, 1.0, (count, robots)) / np.linalg.norm(gaps, axis=2))[..., None]
    anywhere = rng.normal(size=places.shape) * (0.5, 0.5, 0.3)
    return np.where(rng.random((count, robots, 1)) < 0.5, at_another, anywhere)


def promised(states: TeamStates, robot: int, yaw_rates: Array, returns: bool = True) -> tuple[Array, Array]:
    """Return the half-spaces of the safety page (why it holds): normals [n, m, 3], the limit along each [n, m; m/s].

    returns: with those that lead a robot back that is beyond the fence.
    They leave room for the drift. They hold for the velocity as sent and as the vehicle carries it along in a turn:
    v + T yaw_rate (z x v).
    """
    pairs = (_pair(states, robot, other) for other in states.others(robot))
    boxes = (_obstacle(states, robot, box) for box in states.safety.obstacles)
    parts = [_fence(states, robot), *boxes, *pairs, _shaft(states, robot)]
    normals, barriers, times = (np.concatenate(part, axis=1) for part in zip(*parts, strict=True))
    known = np.maximum(np.einsum("nmi,ni->nm", normals, states.drifts[:, robot]), 0.0)
    room = np.minimum(SAFETY.drift_m_s + known, SAFETY.most_drift_m_s)
    most = np.maximum(barriers, 0.0) / times - np.nan_to_num(room)
    if returns:
        most[:, :6] -= np.where(np.isnan(states.drifts[:, robot, :1]), 0.0, _back(states, robot))
    x, y, z = np.moveaxis(normals, 2, 0)
    turn = SAFETY.reaction_s * yaw_rates[:, None]
    turned = np.stack((x + turn * y, y - turn * x, z), axis=2)
    return np.concatenate((normals, turned), axis=1), np.concatenate((most, most), axis=1)


def _fence(states: TeamStates, robot: int) -> tuple[Array, Array, Array]:
    rest, time_s = states.rest(robot)
    kept = SAFETY.margin_m + SAFETY.sigmas * np.sqrt(states.variances(robot))
    barriers = np.concatenate((_FENCE[:, 1] - kept - rest, rest - _FENCE[:, 0] - kept), axis=1)
    normals = np.broadcast_to(np.concatenate((np.eye(3), -np.eye(3))), (len(rest), 6, 3))
    return normals, barriers, np.broadcast_to(time_s[:, None], barriers.shape)


def _back(states: TeamStates, robot: int) -> Array:
    """Return how fast a robot beyond each of the fence's sides is led back, in the order of _fence [n, 6; m/s]."""
    place = states.poses[:, robot, :3]
    beyond = np.concatenate((place - _FENCE[:, 1], _FENCE[:, 0] - place), axis=1)
    beyond[:, 5] = 0.0  # the bottom leads nobody back
    return np.clip(1.5 * beyond, 0.0, SAFETY.return_m_s)


def _obstacle(states: TeamStates, robot: int, box: Box) -> tuple[Array, Array, Array]:
    """Return one row: of the faces that the robot is beside, that of which its point of rest is farthest outside."""
    rest, time_s = states.rest(robot)
    half, middle = np.array(box.size_m) / 2.0, np.array(box.middle_m)
    outwards = np.array([(-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, 1)], dtype=float)
    kept = SAFETY.min_separation_m / 2.0 + SAFETY.margin_m + SAFETY.sigmas * np.sqrt(states.variances(robot))
    beside = (states.poses[:, robot, :3] - middle) @ outwards.T - np.abs(outwards) @ half > 0.0
    barriers = (rest - middle) @ outwards.T - np.abs(outwards) @ half - kept @ np.abs(outwards).T
    beside[~beside.any(axis=1)] = True
    side = np.where(beside, barriers, -np.inf).argmax(axis=1)
    return -outwards[side][:, None], barriers[np.arange(len(side)), side][:, None], time_s[:, None]


def _pair(states: TeamStates, robot: int, other: int) -> tuple[Array, Array, Array]:
    """Return two rows, at the points of rest and at the positions, with half the speed for each robot.

    Where the points of rest lie beyond each other, as seen from the positions, nothing is left of their distance.
    """
    (rest, time_s), (there, its_time_s) = states.rest(robot), states.rest(other)
    apart = states.poses[:, other, :3] - states.poses[:, robot, :3]
    crossed = np.einsum("ni,ni->n", there - rest, apart) <= 0.0
    gaps = np.stack((np.where(crossed[:, None], apart, there - rest), apart), axis=1)
    distances = np.linalg.norm(gaps, axis=2)
    normals = gaps / distances[..., None]
    both = np.zeros((*normals.shape[:2], states.covariances.shape[1]))
    both[..., 4 * other : 4 * other + 3], both[..., 4 * robot : 4 * robot + 3] = normals, -normals
    spread = np.sqrt(np.einsum("nmi,nij,nmj->nm", both, states.covariances, both, optimize=True))
    kept = SAFETY.min_separation_m + SAFETY.margin_m + SAFETY.sigmas * spread
    times = 2.0 * np.maximum(time_s, its_time_s)
    distances[crossed, 0] = 0.0
    return normals, distances - kept, np.broadcast_to(times[:, None], distances.shape)


def _shaft(states: TeamStates, robot: int) -> tuple[Array, Array, Array]:
    """Return two upright rows, as those of a pair that only this robot can keep apart, at half the speed."""
    rest, time_s = states.rest(robot)
    there = np.column_stack((states.shafts[:, :2], np.zeros(len(rest))))
    level = (1.0, 1.0, 0.0)
    apart, gap = (there - states.poses[:, robot, :3]) * level, (there - rest) * level
    crossed = np.einsum("ni,ni->n", gap, apart) <= 0.0
    gaps = np.stack((np.where(crossed[:, None], apart, gap), apart), axis=1)
    distances = np.linalg.norm(gaps, axis=2)
    normals = gaps / distances[..., None]
    own = states.covariances[:, 4 * robot : 4 * robot + 3, 4 * robot : 4 * robot + 3]
    variances = np.einsum("nmi,nij,nmj->nm", normals, own, normals, optimize=True) + states.shafts[:, 2, None]
    kept = SAFETY.min_separation_m + SAFETY.margin_m + SAFETY.sigmas * np.sqrt(variances) + states.shafts[:, 3, None]
    distances[crossed, 0] = 0.0
    absent = np.isnan(states.shafts[:, 0])
    normals[absent], barriers = (1.0, 0.0, 0.0), np.where(absent[:, None], 1e6, distances - kept)
    return normals, barriers, np.broadcast_to(2.0 * time_s[:, None], distances.shape)


def anything_allowed(normals: Array, most: Array) -> BoolArray:
    """Return where some velocity well within a vehicle's limits satisfies all half-spaces [n].

    By linear programs, unlike the limiter: the least excess t with normals v - t <= most.
    """
    found = np.zeros(len(most), dtype=bool)
    across, climb = 0.95 * LIMITS.max_speed_m_s / math.sqrt(2.0), 0.95 * LIMITS.max_climb_m_s
    each = [(-across, across), (-across, across), (-climb, climb), (0.0, None)]
    for first in range(0, len(most), _PROGRAMS):
        N, b = normals[first : first + _PROGRAMS], most[first : first + _PROGRAMS]
        rows = block_diag([np.column_stack((block, -np.ones(len(block)))) for block in N], format="csr")
        solved = linprog(np.tile((0.0, 0.0, 0.0, 1.0), len(N)), rows, b.ravel(), bounds=each * len(N))
        assert solved.status == 0, solved.message
        found[first : first + _PROGRAMS] = solved.x[3::4] <= _MET_M_S
    return found
