"""The search for one topology's local minimum, a few evaluations at a time."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from groundstation.arrays import Array, Vector
from groundstation.kernel import kernel
from groundstation.planning.gradient import evaluate
from groundstation.planning.lbfgs import Descent, descent_from, take
from groundstation.planning.problem import PlanningProblem
from groundstation.planning.records import CostProblem
from groundstation.sensing.topology import Topology

_LEAST_GAIN = 1e-2  # as a share of the tolerance: the search ends with a step that gains less


class SearchState(NamedTuple):
    """A descent over controls x in [-1, 1]^(4 n), with room for u = x * scale; report: of the best point so far, and
    that of the latest, see gradient.evaluate."""

    descent: Descent
    u: Vector
    report: Vector
    latest: Vector


def search_state(start: Vector, report_size: int) -> SearchState:
    """Return the state of a search that begins at a start in [-1, 1]^(4 n)."""
    return SearchState(descent_from(start, 0.0), np.empty(start.size), np.empty(report_size), np.empty(report_size))


@kernel()
def solve(state: SearchState, problem: CostProblem, budget: int, limit: int, tolerance: float) -> bool:
    """Minimise for up to `budget` further evaluations, `limit` in all; returns whether it is over. x is the best point.

    A first cost that is not finite gives no direction: x stays, and the cost is infinite.
    """
    descent, u, scale, latest = state.descent, state.u, problem.scale, state.latest
    progress, gradient = descent.progress[0], descent.trial_gradient
    until = min(progress.evaluations + budget, limit)
    while progress.over == 0 and progress.evaluations < until:
        for k in range(u.shape[0]):
            u[k] = descent.trial[k] * scale[k]
        cost = evaluate(u, problem, True, gradient, latest)
        for k in range(u.shape[0]):
            gradient[k] *= scale[k]
        if take(descent, cost, tolerance, _LEAST_GAIN * tolerance):
            for k in range(latest.shape[0]):
                state.report[k] = latest[k]
    if progress.evaluations >= limit:
        progress.over = 1
    return bool(progress.over != 0)


@dataclass(frozen=True, slots=True)
class Solution:
    """Controls u (4 n) with their cost; report (1 + m): the uncertainty alone, each edge's mean information."""

    topology: Topology
    cost: float
    controls: Array
    report: Array


class LocalSearch:
    """The search from a start; over: see `solve`."""

    def __init__(self, problem: PlanningProblem, start: Array, limit: int, tolerance: float) -> None:
        self.problem = problem
        self._state = search_state(start, 1 + len(problem.cost.edges))
        self._progress = self._state.descent.progress[0]
        self._limit, self._tolerance = limit, tolerance

    def advance(self, until: int) -> bool:
        """Continue for one time check's evaluations, or up to `until` of them in all; returns whether it is over."""
        budget = min(self.problem.evaluations_at_once, until - self.evaluations)
        return bool(solve(self._state, self.problem.cost, budget, self._limit, self._tolerance))

    @property
    def over(self) -> bool:
        """Return whether it has ended."""
        return bool(self._progress["over"])

    @property
    def cost(self) -> float:
        """Return the least cost so far."""
        return float(self._progress["cost"])

    @property
    def evaluations(self) -> int:
        """Return the number of evaluations so far."""
        return int(self._progress["evaluations"])

    def solution(self) -> Solution:
        """Return the best point so far."""
        problem = self.problem
        return Solution(problem.topology, self.cost, self._state.descent.x * problem.scale, self._state.report)
