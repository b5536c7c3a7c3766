"""The planar planner: one decision per call, with a certificate for every topology it dropped."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import overload

import numpy as np

from groundstation.arrays import Array, IntArray
from groundstation.experiments.planar.candidates import MOST_CUTS, all_topologies, candidate_list
from groundstation.experiments.planar.minimise import FAILED
from groundstation.experiments.planar.parameters import PlanarParameters
from groundstation.experiments.planar.problem import make_problem, make_workspace
from groundstation.experiments.planar.records import Candidates, Limits, PlanarProblem
from groundstation.experiments.planar.search import (
    DROPPED_BY_REACH,
    DROPPED_BY_TANGENT,
    SKIPPED,
    SOLVED,
    certified_search,
    solve_topology,
)


class SearchMode(StrEnum):
    """Choice and judgement of candidates (docs/explanation/planning.md 8.3).

    PAPER: plain neighbours, each solved, cheapest wins, no hysteresis. CERTIFIED: neighbours, radial cuts and merges,
    dropped with proof where possible. GLOBAL: all topologies with proof, at most 6 robots. FIXED: the current one only.
    """

    PAPER = "paper"
    CERTIFIED = "certified"
    GLOBAL = "global"
    FIXED = "fixed"


class Fate(StrEnum):
    """Fate of a candidate: solved, proved unable to win by its tangent or reach bound, or not finished."""

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


class Certificate(Sequence[Considered]):
    """All candidates of one decision, the current topology first; rows are made on access."""

    def __init__(self, levels: IntArray, costs: Array, bounds: Array, fates: IntArray) -> None:
        self._levels, self._costs, self._bounds, self._fates = levels, costs, bounds, fates

    def __len__(self) -> int:
        return len(self._costs)

    @overload
    def __getitem__(self, index: int) -> Considered: ...
    @overload
    def __getitem__(self, index: slice) -> list[Considered]: ...
    def __getitem__(self, index: int | slice) -> Considered | list[Considered]:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        cost, level = float(self._costs[index]), tuple(int(k) for k in self._levels[index])
        fate = _FATES.get(int(self._fates[index]), Fate.SKIPPED)
        return Considered(level, None if np.isnan(cost) else cost, float(self._bounds[index]), fate)

    def count(self, value: object) -> int:
        """Return how many candidates met a fate."""
        return sum(int((self._fates == code).sum()) for code, fate in _FATES.items() if fate == value)

    @property
    def complete(self) -> bool:
        """Return whether every candidate was solved or dropped with proof."""
        return bool((self._fates != SKIPPED).all())


@dataclass(frozen=True, slots=True)
class PlanarPlan:
    """A decision: level vector (n), velocities (segments, n, 2) [m/s], cost [m^2], and its certificate.

    `switched` says that the topology differs from the current one; certificate[0] is the current topology.
    """

    level: IntArray
    velocity_m_s: Array
    cost: float
    switched: bool
    evaluations: int
    certificate: Certificate = field(repr=False)

    @property
    def complete(self) -> bool:
        """Return whether every candidate was solved or dropped with proof (False: the budget ran out)."""
        return self.certificate.complete


@dataclass(frozen=True, slots=True)
class SearchOptions:
    """Effort and width of the search; raises ValueError for values without meaning.

    hysteresis: share of the current cost that a switch must save (not in PAPER mode); tolerance: scaled projected
    gradient; budget: cost evaluations; segments: piecewise-constant controls over the horizon; starts: random
    multi-starts of the winner beside the warm start; wide: radial cuts and merges in CERTIFIED mode; prune: False
    solves every candidate instead of dropping with proof.
    """

    mode: SearchMode = SearchMode.CERTIFIED
    hysteresis: float = 0.0
    tolerance: float = 1e-4
    budget: int = 1_000_000
    segments: int = 1
    starts: int = 0
    wide: bool = True
    prune: bool = True

    def __post_init__(self) -> None:
        if not (0.0 <= self.hysteresis < 1.0 and self.tolerance > 0.0 and self.budget >= 1 and self.starts >= 0):
            raise ValueError(f"hysteresis must lie in [0, 1), tolerance above 0, budget from 1, starts from 0: {self}")


class PlanarPlanner:
    """Plans for a fixed team size; keeps scratch memory and the last controls as warm start."""

    def __init__(
        self,
        robots: int,
        parameters: PlanarParameters,
        options: SearchOptions | None = None,
        generator: np.random.Generator | None = None,
    ) -> None:
        """The generator draws multi-starts; without one they are the same in every planner."""
        if robots < 1:
            raise ValueError(f"a team has at least one robot (got {robots})")
        self.parameters = parameters
        self.options = options or SearchOptions()
        self._generator = generator or np.random.default_rng(0)
        self._work = make_workspace(robots, parameters.steps)
        self._all = all_topologies(robots) if self.options.mode is SearchMode.GLOBAL else None
        rows = len(self._all) if self._all is not None else 3 * robots + MOST_CUTS + 1
        self._rows = np.empty((rows, robots), dtype=np.int64)
        self._controls = np.empty((rows, 2 * robots * self.options.segments))
        self._warm = np.zeros(2 * robots * self.options.segments)
        self.stop = np.zeros(1, dtype=np.int64)

    def reset(self) -> None:
        """Forget the last controls: the next plan starts from rest."""
        self._warm = np.zeros_like(self._warm)

    def plan(
        self, mean: Array, covariance: Array, level: IntArray, target_velocity_m_s: Array | None = None
    ) -> PlanarPlan:
        """Return the decision for a belief: mean (n + 1, 2), per-axis covariance (n + 1, n + 1), current levels (n).

        target_velocity_m_s (2): the target's predicted mean motion, instead of the parameters' own.
        Set `stop[0]` from another thread to end early with the best so far. Raises ValueError for a belief that is not
        finite or not positive definite, or a level vector with gaps.
        """
        level = _checked(level, self._rows.shape[1])
        problem = make_problem(mean, covariance, self.parameters, self.options.segments)
        if len(problem.mean) != len(level) + 1:
            raise ValueError(f"the planner was made for {len(level)} robots (got {len(problem.mean) - 1})")
        if target_velocity_m_s is not None:
            vx, vy = map(float, target_velocity_m_s)
            constants = problem.constants._replace(target_velocity_x=vx, target_velocity_y=vy)
            problem = problem._replace(constants=constants)
        options, total = self.options, self._candidates(problem.mean, level)
        paper = options.mode is SearchMode.PAPER
        candidates = Candidates(
            self._rows[:total], np.empty(total), np.empty(total), np.empty(total, np.int64), self._controls[:total]
        )
        limits = Limits(options.tolerance, options.budget, self.stop)
        hysteresis, prune = 0.0 if paper else float(options.hysteresis), options.prune and not paper
        best, evaluations = certified_search(candidates, self._warm, problem, self._work, limits, hysteresis, prune)
        if best < 0:
            raise ValueError("the predicted covariance is not positive definite")
        self._warm = self._controls[best].copy()
        cost, more = self._restart(
            problem, self._rows[best], float(candidates.costs[best]), options.budget - evaluations
        )
        velocity = self._warm.reshape(options.segments, len(level), 2) * self.parameters.max_speed_m_s
        certificate = Certificate(self._rows[:total].copy(), candidates.costs, candidates.bounds, candidates.fates)
        return PlanarPlan(self._rows[best].copy(), velocity, cost, best != 0, int(evaluations) + more, certificate)

    def _candidates(self, mean: Array, level: IntArray) -> int:
        """Put the candidates into `_rows`, the current topology first; return how many."""
        if self._all is not None:
            own = int((self._all == level).all(axis=1).argmax())
            self._rows[0], self._rows[1 : own + 1], self._rows[own + 1 :] = level, self._all[:own], self._all[own + 1 :]
            return len(self._rows)
        if self.options.mode is SearchMode.FIXED:
            self._rows[0] = level
            return 1
        wide = self.options.wide and self.options.mode is SearchMode.CERTIFIED
        return int(candidate_list(level, mean, wide, self._rows))

    def _restart(self, problem: PlanarProblem, level: IntArray, cost: float, budget: int) -> tuple[float, int]:
        """Solve the winner from random starts too; keep the best controls as `_warm`. Returns cost and evaluations."""
        spent = 0
        for _ in range(self.options.starts):
            if self.stop[0] or spent >= budget:
                break
            start, found = self._generator.uniform(-1.0, 1.0, len(self._warm)), np.empty(len(self._warm))
            limits = Limits(self.options.tolerance, budget - spent, self.stop)
            value, used, status = solve_topology(level, start, problem, self._work, cost, limits, found)
            spent += used
            if status != FAILED and value < cost:
                cost, self._warm = float(value), found
        return cost, int(spent)


def _checked(level: IntArray, robots: int) -> IntArray:
    level = np.ascontiguousarray(level, dtype=np.int64)
    if level.shape != (robots,) or set(level.tolist()) != set(range(int(level.max()) + 1)):
        raise ValueError(
            f"need a level for each of {robots} robots, counted from 0 without gaps (got {level.tolist()})"
        )
    return level
