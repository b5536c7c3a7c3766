"""One certified control step: solve the current topology, bound all candidates, solve only those that may win."""

import numpy as np
from numba import njit, types

from groundstation.planning.planar.bounds import (
    pair_sensitivities,
    reach_bound,
    reach_information,
    summed_sensitivity,
)
from groundstation.planning.planar.edges import list_edges
from groundstation.planning.planar.lbfgs import FAILED, minimise
from groundstation.planning.planar.problem import PROBLEM, WORKSPACE

DROPPED_BY_TANGENT, DROPPED_BY_REACH, SOLVED, SKIPPED = 0, 1, 2, 3

# A bound must beat the incumbent by more than rounding before a topology is dropped with it.
_ROUNDING = 1.0 + 1e-9

_f1, _f2, _f8, _i1, _i2, _i8 = (
    types.float64[::1],
    types.float64[:, ::1],
    types.float64,
    types.int64[::1],
    types.int64[:, ::1],
    types.int64,
)


@njit(types.void(_i2, PROBLEM, WORKSPACE, types.float64[:, :, ::1], _f1), cache=True, nogil=True)
def tangent_bounds(levels, problem, work, reach, bounds):  # type: ignore[no-untyped-def]
    """Write the reach bound of levels[0] and the tangent bounds of all others [m^2]."""
    size = problem.mean.shape[0]
    pairs = np.empty((size + 1, size + 1))
    count = list_edges(levels[0], work.edges)
    bounds[0] = reach_bound(reach, count, problem, work)
    pair_sensitivities(reach, problem, work, pairs)
    base = bounds[0] - summed_sensitivity(pairs, count, work)
    for t in range(1, levels.shape[0]):
        count = list_edges(levels[t], work.edges)
        bounds[t] = base + summed_sensitivity(pairs, count, work)


@njit(
    types.Tuple((_i8, _i8))(_i2, _f1, PROBLEM, WORKSPACE, _f8, _i8, _i1, types.boolean, _f1, _f1, _i1, _f2),
    cache=True,
    nogil=True,
)
def certified_search(  # type: ignore[no-untyped-def]
    levels, start, problem, work, tolerance, budget, stop, prune, bounds, costs, fates, controls
):
    """Find the cheapest of levels (K, n), levels[0] being the current topology; return (best row, evaluations).

    start: scaled controls to begin from; stop[0] != 0 (set by another thread) ends the search with the incumbent.
    Writes per topology: bounds, costs (NaN where not solved), fates, and scaled controls. With prune=False every
    topology is solved from the current one's optimum (warm brute force).
    """
    total = levels.shape[0]
    costs[:], fates[:], bounds[:] = np.nan, SKIPPED, -np.inf
    controls[0] = start
    count = list_edges(levels[0], work.edges)
    costs[0], evaluations, status = minimise(controls[0], count, problem, work, 0.0, tolerance, budget)
    if status == FAILED:
        return -1, evaluations
    scale = costs[0]
    fates[0], best = SOLVED, 0
    if total == 1:
        return best, evaluations
    reach = np.empty((problem.steps, problem.mean.shape[0] + 1, problem.mean.shape[0] + 1))
    if prune:
        reach_information(problem, reach)
        tangent_bounds(levels, problem, work, reach, bounds)
        evaluations += 1
    order = 1 + np.argsort(bounds[1:])
    for k in range(total - 1):
        t = order[k]
        if bounds[t] >= costs[best] * _ROUNDING:
            fates[order[k:]] = DROPPED_BY_TANGENT
            break
        if stop[0] != 0 or evaluations >= budget:
            break
        count = list_edges(levels[t], work.edges)
        if prune:
            evaluations += 1
            bounds[t] = max(bounds[t], reach_bound(reach, count, problem, work))
            if bounds[t] >= costs[best] * _ROUNDING:
                fates[t] = DROPPED_BY_REACH
                continue
        controls[t] = controls[0]
        costs[t], used, status = minimise(controls[t], count, problem, work, scale, tolerance, budget - evaluations)
        evaluations += used
        fates[t] = SOLVED
        if status != FAILED and costs[t] < costs[best]:
            best = t
    return best, evaluations
