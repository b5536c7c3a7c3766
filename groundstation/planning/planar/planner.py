"""The planar planner: one decision per call, with a certificate for every topology it dropped."""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from groundstation.planning.planar.candidates import all_topologies, merges, neighbours, radial_cuts
from groundstation.planning.planar.parameters import PlanarParameters
from groundstation.planning.planar.problem import Problem, Workspace, make_problem, make_workspace
from groundstation.planning.planar.search import (
    DROPPED_BY_REACH,
    DROPPED_BY_TANGENT,
    SOLVED,
    certified_search,
)

Array = NDArray[np.float64]
Levels = NDArray[np.int64]


class Mode(StrEnum):
    """How candidates are chosen and judged.

    PAPER: plain neighbours, each solved, cheapest wins, no hysteresis. CERTIFIED: neighbours, radial cuts and merges,
    dropped with proof where possible. GLOBAL: all topologies with proof, at most 6 robots. FIXED: the current one only.
    """

    PAPER = "paper"
    CERTIFIED = "certified"
    GLOBAL = "global"
    FIXED = "fixed"


class Fate(StrEnum):
    """What became of a candidate: solved, proved unable to win by its tangent or reach bound, or not reached."""

    SOLVED = "solved"
    TANGENT_BOUND = "tangent bound"
    REACH_BOUND = "reach bound"
    SKIPPED = "skipped"


_FATES = {SOLVED: Fate.SOLVED, DROPPED_BY_TANGENT: Fate.TANGENT_BOUND, DROPPED_BY_REACH: Fate.REACH_BOUND}


@dataclass(frozen=True, slots=True)
class Considered:
    """One candidate: level vector, its optimised cost if solved, and a proved lower bound on its cost [m^2]."""

    level: tuple[int, ...]
    cost: float | None
    bound: float
    fate: Fate


@dataclass(frozen=True, slots=True)
class PlanarPlan:
    """A decision: level vector (n), velocities (segments, n, 2) [m/s], cost [m^2], and why.

    `switched` says that the topology differs from the current one; certificate[0] is the current topology.
    """

    level: Levels
    velocity_m_s: Array
    cost: float
    switched: bool
    evaluations: int
    certificate: tuple[Considered, ...] = field(repr=False)

    @property
    def complete(self) -> bool:
        """Return whether every candidate was solved or dropped with proof (False: the budget ran out)."""
        return all(candidate.fate is not Fate.SKIPPED for candidate in self.certificate)


@dataclass(frozen=True, slots=True)
class SearchOptions:
    """hysteresis: relative gain a switch must bring (not in PAPER mode); tolerance: scaled projected gradient;

    budget: cost evaluations; segments: piecewise-constant controls over the horizon; starts: random multi-starts of
    the winner beside the warm start.
    """

    mode: Mode = Mode.CERTIFIED
    hysteresis: float = 0.0
    tolerance: float = 1e-4
    budget: int = 1_000_000
    segments: int = 1
    starts: int = 0


class PlanarPlanner:
    """Plans for a fixed team size; keeps scratch memory and the last controls as warm start."""

    def __init__(self, robots: int, parameters: PlanarParameters, options: SearchOptions | None = None) -> None:
        if robots < 1:
            raise ValueError(f"a team has at least one robot (got {robots})")
        self.parameters = parameters
        self.options = options or SearchOptions()
        self._work: Workspace = make_workspace(robots, parameters.steps)
        self._neighbours = np.empty((2 * robots, robots), dtype=np.int64)
        self._all = all_topologies(robots) if self.options.mode is Mode.GLOBAL else None
        self._warm = np.zeros(2 * robots * self.options.segments)
        self.stop = np.zeros(1, dtype=np.int64)

    def plan(
        self, mean: Array, covariance: Array, level: Levels, target_velocity_m_s: Array | None = None
    ) -> PlanarPlan:
        """Return the decision for a belief: mean (n + 1, 2), per-axis covariance (n + 1, n + 1), current levels (n).

        target_velocity_m_s (2): the target's predicted mean motion, instead of the parameters' own.
        Set `stop[0]` from another thread to end early with the best so far. Raises ValueError for a belief that is not
        finite or not positive definite, or a level vector with gaps.
        """
        level = _checked(level, len(self._neighbours) // 2)
        problem = make_problem(mean, covariance, self.parameters, self.options.segments)
        if target_velocity_m_s is not None:
            problem.constants[7:9] = target_velocity_m_s
        candidates = self._candidates(problem.mean, level)
        total = len(candidates)
        bounds, costs = np.empty(total), np.empty(total)
        fates, controls = np.empty(total, dtype=np.int64), np.empty((total, len(self._warm)))
        prune = self.options.mode is not Mode.PAPER
        best, evaluations = certified_search(
            candidates,
            self._warm,
            problem,
            self._work,
            self.options.tolerance,
            self.options.budget,
            self.stop,
            prune,
            bounds,
            costs,
            fates,
            controls,
        )
        if best < 0:
            raise ValueError("the predicted covariance is not positive definite")
        chosen = 0 if prune and costs[best] > (1.0 - self.options.hysteresis) * costs[0] else best
        certificate = tuple(
            Considered(tuple(int(k) for k in row), _known(cost), float(bound), _FATES.get(int(fate), Fate.SKIPPED))
            for row, cost, bound, fate in zip(candidates, costs, bounds, fates, strict=True)
        )
        self._warm = controls[chosen].copy()
        return self._plan(problem, candidates[chosen], float(costs[chosen]), chosen != 0, evaluations, certificate)

    def _candidates(self, mean: Array, level: Levels) -> Levels:
        if self._all is not None:
            others = self._all[(self._all != level).any(axis=1)]
            return np.concatenate([level[None], others])
        if self.options.mode is Mode.FIXED:
            return level[None]
        near = self._neighbours[: neighbours(level, self._neighbours)]
        if self.options.mode is Mode.PAPER:
            return np.concatenate([level[None], near])
        rows = np.concatenate([level[None], near, radial_cuts(mean), merges(level)])
        _, first = np.unique(rows, axis=0, return_index=True)
        return np.ascontiguousarray(rows[np.sort(first)])

    def _plan(
        self,
        problem: Problem,
        level: Levels,
        cost: float,
        switched: bool,
        evaluations: int,
        certificate: tuple[Considered, ...],
    ) -> PlanarPlan:
        velocity = self._warm.reshape(self.options.segments, len(level), 2) * self.parameters.max_speed_m_s
        return PlanarPlan(level.copy(), velocity, cost, switched, int(evaluations), certificate)


def _known(cost: float) -> float | None:
    return None if np.isnan(cost) else float(cost)


def _checked(level: Levels, robots: int) -> Levels:
    level = np.ascontiguousarray(level, dtype=np.int64)
    if level.shape != (robots,) or set(level.tolist()) != set(range(int(level.max()) + 1)):
        raise ValueError(
            f"need a level for each of {robots} robots, counted from 0 without gaps (got {level.tolist()})"
        )
    return level
