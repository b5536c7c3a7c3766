"""One certified control step: solve the current topology, bound all candidates, solve only those that may win."""

import numpy as np

from groundstation.arrays import IntVector, Matrix, Vector
from groundstation.experiments.planar.bounds import reach_bound, reach_information, tangent_bounds
from groundstation.experiments.planar.minimise import FAILED, OUT_OF_BUDGET, minimise
from groundstation.experiments.planar.moved import optimum_of
from groundstation.experiments.planar.problem import load_topology, reorder
from groundstation.experiments.planar.records import Candidates, Limits, Optimum, PlanarProblem, Workspace
from groundstation.experiments.planar.resting import learn, resting_cost, take_controls
from groundstation.kernel import kernel

DROPPED_BY_TANGENT, DROPPED_BY_REACH, SOLVED, SKIPPED = 0, 1, 2, 3

# A bound must beat the incumbent by more than rounding before a topology is dropped with it.
_ROUNDING = 1.0 + 1e-9

# If a topology is solved with this few evaluations, a reach bound costs as much as solving the next one.
_CHEAP = 2


@kernel()
def solve_topology(
    level: IntVector, start: Vector, problem: PlanarProblem, work: Workspace, scale: float, limits: Limits,
    controls: Vector,
) -> tuple[float, int, int]:  # fmt: skip
    """Minimise one topology's cost from `start` into `controls`; see `minimise` for the rest."""
    robots = level.shape[0]
    load_topology(level, problem, work)
    x = np.empty(start.shape[0])
    reorder(start, robots, work, x, True)
    result = minimise(x, problem, work, scale, limits)
    reorder(x, robots, work, controls, False)
    return result


@kernel()
def _rests(
    t: int, candidates: Candidates, at: Optimum, problem: PlanarProblem, limits: Limits, limit: float, doubt: Matrix
) -> bool:
    """Judge a candidate by the current topology's adjoint; return whether that will do."""
    cost = resting_cost(candidates.levels[t], at, candidates.costs[0], problem, limits.tolerance, doubt)
    if not cost >= limit * _ROUNDING:
        return False
    candidates.costs[t], candidates.fates[t] = cost, SOLVED
    take_controls(at, candidates.controls[t])
    return True


@kernel()
def certified_search(
    candidates: Candidates, start: Vector, problem: PlanarProblem, work: Workspace, limits: Limits,
    hysteresis: float, prune: bool,
) -> tuple[int, int]:  # fmt: skip
    """Find the cheapest candidate, levels[0] being the current topology; return (best row, evaluations).

    start: scaled controls to begin from; hysteresis: share of the current topology's cost that another one must save.
    limits: of all minimisations together; when they are reached, the incumbent is returned. Writes bounds, costs (NaN
    where not begun), fates (SKIPPED also where not finished), and controls. With prune=False every topology is solved
    from the current one's optimum (warm brute force). The row is -1 when the belief is numerically hopeless.
    """
    levels, bounds, costs = candidates.levels, candidates.bounds, candidates.costs
    fates, controls, stop, total = candidates.fates, candidates.controls, limits.stop, candidates.levels.shape[0]
    costs[:], fates[:], bounds[:] = np.nan, SKIPPED, -np.inf
    costs[0], evaluations, status = solve_topology(levels[0], start, problem, work, 0.0, limits, controls[0])
    if status == FAILED:
        return -1, evaluations
    scale = costs[0]
    best, limit = 0, costs[0] * (1.0 - hysteresis)
    fates[0] = SKIPPED if status == OUT_OF_BUDGET else SOLVED
    if total == 1 or stop[0] != 0 or evaluations >= limits.budget:
        return best, evaluations
    size = problem.mean.shape[0]
    reach = np.empty((problem.steps, size + 1, size + 1))
    if prune:
        reach_information(problem, reach)
        tangent_bounds(levels, reach, problem, work, bounds)
        evaluations += 1
    order = 1 + np.argsort(bounds[1:], kind="mergesort")
    used, resting, at = limits.budget, 0, optimum_of(levels[0], controls[0], problem.steps)
    doubt = np.full((2 * levels.shape[1], 2), np.inf)
    for k in range(total - 1):
        t = int(order[k])
        if bounds[t] >= limit * _ROUNDING:
            for rest in range(k, total - 1):
                fates[order[rest]] = DROPPED_BY_TANGENT
            break
        if stop[0] != 0 or evaluations >= limits.budget:
            break
        if prune and used > _CHEAP:
            evaluations += 1
            bounds[t] = max(bounds[t], reach_bound(levels[t], reach, problem, work))
            if bounds[t] >= limit * _ROUNDING:
                fates[t] = DROPPED_BY_REACH
                continue
        if prune and _rests(t, candidates, at, problem, limits, limit, doubt):
            continue
        rest_of = Limits(limits.tolerance, limits.budget - evaluations, stop)
        costs[t], used, status = solve_topology(levels[t], controls[0], problem, work, scale, rest_of, controls[t])
        evaluations += used
        if status == FAILED:
            costs[t] = np.nan
            continue
        fates[t] = SKIPPED if status == OUT_OF_BUDGET else SOLVED
        if costs[t] < limit:
            best, limit = t, costs[t]
        if prune and used == 1:
            resting += 1
            evaluations += learn(levels[t], costs[t], resting, at, scale, problem, work, doubt)
    return best, evaluations
