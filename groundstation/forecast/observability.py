"""Observable entries of the filter's state, and its least certain direction, for a sensing topology."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import CORE_SIZE, EntityKind
from groundstation.estimation.motion import DIFFUSE_M2, DIFFUSE_RAD2
from groundstation.estimation.tables import tables_from_parameters
from groundstation.field.resolved import ResolvedField
from groundstation.forecast.flown_filter import FlownFilter
from groundstation.forecast.stands import StandSearch
from groundstation.forecast.team import Place, Team
from groundstation.sensing.topology import Topology

FLOWN_S = 10.0
_LEARNED = 0.25  # of its variance before: a direction whose deviation is at least halved counts as observed
_NAMED = 0.35  # least part of a direction with which an entry is named
_BEFORE = (DIFFUSE_M2, DIFFUSE_M2, DIFFUSE_M2, DIFFUSE_RAD2)
_LARGEST_TEAM = 3  # largest team of which all topologies are computed


@dataclass(frozen=True, slots=True)
class Entry:
    """One entry of the state with its deviations before and after: m, m/s, rad, rad/s, or a factor."""

    name: str
    before: float
    after: float

    @property
    def is_told(self) -> bool:
        """Return whether the flight has at least halved its deviation."""
        return self.after**2 < _LEARNED * self.before**2


@dataclass(frozen=True, slots=True)
class Direction:
    """A direction of the state: its deviation, and its entries with their parts."""

    std: float
    parts: tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True)
class Observability:
    """The observability of the state by a team in one topology, in FLOWN_S of flight.

    rank: directions of the state whose deviation is at least halved; missing: entities never in it; worst_m: the
    least certain direction of all places; worst_yaw: likewise of the drones' headings [rad]. Both None if none is in
    the state.
    """

    topology: Topology
    entries: tuple[Entry, ...]
    rank: int
    missing: tuple[str, ...]
    worst_m: Direction | None
    worst_yaw: Direction | None

    @property
    def untold(self) -> tuple[str, ...]:
        """Return the entries whose deviation is not halved."""
        return tuple(entry.name for entry in self.entries if not entry.is_told)


def topologies_of(team: Team, chosen: Iterable[Topology]) -> list[Topology]:
    """Return the topologies to compute: all of a small team, else flat, string and those chosen."""
    flat = Topology.flat(team.robots)
    if len(team.robots) <= _LARGEST_TEAM:
        found = dict.fromkeys((flat,))
        for one in (queue := [flat]):
            queue += [near for near in one.neighbours() if near not in found and not found.setdefault(near)]
    else:
        found = dict.fromkeys((flat, Topology.string(team.robots), *chosen))
    return [one for one in found if team.planner.level_heights(len(one.levels))]


def observe(field: ResolvedField, team: Team, place: Place, topologies: Iterable[Topology]) -> list[Observability]:
    """Return the observability of each topology's stand for a target at a place, all moving along a small circle."""
    search, joint = StandSearch(team), FlownFilter(field, team)
    found = []
    for topology in topologies:
        poses = search.held(place, topology).poses
        found.append(_judged(topology, joint, joint.belief(poses, place, FLOWN_S, _BEFORE, circling=True)))
    return found


def _judged(topology: Topology, joint: FlownFilter, belief: JointBelief) -> Observability:
    before, layout = _variances_before(joint), belief.layout
    missing = tuple(name for name in (*joint.team.robots, joint.team.target) if name not in layout)
    start = np.array([before[label] for label in layout.labels])
    after = np.diag(belief.covariance)
    entries = [Entry(*each) for each in zip(layout.labels, np.sqrt(start), np.sqrt(after), strict=True)]
    scale = np.sqrt(np.maximum(start, 1e-18))
    shares = np.linalg.eigvalsh(belief.covariance / np.outer(scale, scale))
    rank = int(np.count_nonzero(shares < _LEARNED))
    places, yaws = _core(belief, (0, 1, 2)), _core(belief, (3,))
    return Observability(
        topology,
        tuple(entries),
        rank,
        missing,
        _worst(belief, places, layout.labels),
        _worst(belief, yaws, layout.labels),
    )


def _core(belief: JointBelief, wanted: tuple[int, ...]) -> list[int]:
    """Return the entries that are places (0, 1, 2) or headings (3): a target's third and fourth are speeds."""
    moving = {EntityKind.ROBOT: CORE_SIZE, EntityKind.TARGET: 2}
    return [
        block.start + i for block in belief.layout.blocks for i in wanted if i < moving.get(block.kind, 0)
    ]  # fmt: skip


def _worst(belief: JointBelief, chosen: list[int], labels: tuple[str, ...]) -> Direction | None:
    if not chosen:
        return None
    values, vectors = np.linalg.eigh(belief.covariance[np.ix_(chosen, chosen)])
    vector: Array = vectors[:, -1] * math.copysign(1.0, float(vectors[np.abs(vectors[:, -1]).argmax(), -1]))
    order = [int(i) for i in np.argsort(-np.abs(vector)) if abs(vector[i]) >= _NAMED]
    parts = tuple((labels[chosen[i]], float(vector[i])) for i in order)
    return Direction(float(np.sqrt(values[-1])), parts)


def _variances_before(joint: FlownFilter) -> dict[str, float]:
    """Return the initial variance of each entry: from surveys and error habits, unknown for places."""
    tables = tables_from_parameters(joint.parameters)
    found: dict[str, float] = {}
    for row, (name, model) in enumerate(joint.parameters.entities.items()):
        variances = tables.priors["variances"][row, : len(model.labels)].tolist()
        known = {EntityKind.ROBOT: _BEFORE, EntityKind.TARGET: _BEFORE[:2]}.get(model.kind, ())
        variances[: len(known)] = known
        found |= {f"{name}.{label}": value for label, value in zip(model.labels, variances, strict=True)}
    return found
