"""One certified control step: solve the current topology, bound all candidates, solve only those that may win."""

import numpy as np
from numba import njit, types

from groundstation.experiments.planar.bounds import reach_bound, reach_information, tangent_bounds
from groundstation.experiments.planar.lbfgs import FAILED, OUT_OF_BUDGET, minimise
from groundstation.experiments.planar.problem import PROBLEM, WORKSPACE, load_topology

DROPPED_BY_TANGENT, DROPPED_BY_REACH, SOLVED, SKIPPED = 0, 1, 2, 3

# A bound must beat the incumbent by more than rounding before a topology is dropped with it.
_ROUNDING = 1.0 + 1e-9

# Where a topology is solved with so few evaluations, a reach bound to avoid the next one costs as much.
_CHEAP = 2

_f1, _f2, _f8, _i1, _i2, _i8 = (
    types.float64[::1],
    types.float64[:, ::1],
    types.float64,
    types.int64[::1],
    types.int64[:, ::1],
    types.int64,
)


@njit(types.void(_f1, _i8, WORKSPACE, _f1, types.boolean), cache=True, nogil=True)
def reorder(source, robots, work, target, to_sorted):  # type: ignore[no-untyped-def]
    """Copy controls (segments * n * 2) into, or out of, the sorted order of the workspace's topology."""
    for first in range(0, source.shape[0], 2 * robots):
        for place in range(robots):
            a, b = first + 2 * work.order[place], first + 2 * place
            if not to_sorted:
                a, b = b, a
            target[b], target[b + 1] = source[a], source[a + 1]


@njit(
    types.Tuple((_f8, _i8, _i8))(_i1, _f1, PROBLEM, WORKSPACE, _f8, _f8, _i8, _i1, _f1),
    cache=True,
    nogil=True,
)
def solve_topology(level, start, problem, work, scale, tolerance, budget, stop, controls):  # type: ignore[no-untyped-def]
    """Minimise one topology's cost from `start` into `controls`; see `minimise` for the rest."""
    robots = level.shape[0]
    load_topology(level, problem, work)
    x = np.empty(start.shape[0])
    reorder(start, robots, work, x, True)
    result = minimise(x, problem, work, scale, tolerance, budget, stop)
    reorder(x, robots, work, controls, False)
    return result


@njit(
    types.Tuple((_i8, _i8))(_i2, _i8, _f1, PROBLEM, WORKSPACE, _f8, _i8, _f8, _i1, types.boolean, _f1, _f1, _i1, _f2),
    cache=True,
    nogil=True,
)
def certified_search(  # type: ignore[no-untyped-def]
    levels, total, start, problem, work, tolerance, budget, hysteresis, stop, prune, bounds, costs, fates, controls
):
    """Find the cheapest of levels[:total] (., n), levels[0] being the current topology; return (best row, evaluations).

    start: scaled controls to begin from; hysteresis: share of the current topology's cost that another one must save;
    stop[0] != 0 (set by another thread) ends the search with the incumbent. Writes per topology: bounds, costs (NaN
    where not begun), fates (SKIPPED also where not finished), and scaled controls. With prune=False every topology is
    solved from the current one's optimum (warm brute force). The row is -1 when the belief is numerically hopeless.
    """
    costs[:total], fates[:total], bounds[:total] = np.nan, SKIPPED, -np.inf
    costs[0], evaluations, status = solve_topology(
        levels[0], start, problem, work, 0.0, tolerance, budget, stop, controls[0]
    )
    if status == FAILED:
        return -1, evaluations
    scale = costs[0]
    best, limit = 0, costs[0] * (1.0 - hysteresis)
    fates[0] = SKIPPED if status == OUT_OF_BUDGET else SOLVED
    if total == 1 or stop[0] != 0 or evaluations >= budget:
        return best, evaluations
    size = problem.mean.shape[0]
    reach = np.empty((problem.steps, size + 1, size + 1))
    if prune:
        reach_information(problem, reach)
        tangent_bounds(levels, total, reach, problem, work, bounds)
        evaluations += 1
    order = 1 + np.argsort(bounds[1:total], kind="mergesort")
    used = budget
    for k in range(total - 1):
        t = order[k]
        if bounds[t] >= limit * _ROUNDING:
            for rest in range(k, total - 1):
                fates[order[rest]] = DROPPED_BY_TANGENT
            break
        if stop[0] != 0 or evaluations >= budget:
            break
        if prune and used > _CHEAP:
            evaluations += 1
            bounds[t] = max(bounds[t], reach_bound(levels[t], reach, problem, work))
            if bounds[t] >= limit * _ROUNDING:
                fates[t] = DROPPED_BY_REACH
                continue
        costs[t], used, status = solve_topology(
            levels[t], controls[0], problem, work, scale, tolerance, budget - evaluations, stop, controls[t]
        )
        evaluations += used
        if status == FAILED:
            costs[t] = np.nan
            continue
        fates[t] = SKIPPED if status == OUT_OF_BUDGET else SOLVED
        if costs[t] < limit:
            best, limit = t, costs[t]
    return best, evaluations
