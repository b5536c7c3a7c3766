"""Shared part of the peers: optimises the current topology and each neighbour with SciPy, takes the cheapest."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize

from groundstation.arrays import Array

Objective = Callable[[Array], Any]


class PeerStep(NamedTuple):
    """The winner's levels and cost [m^2], and the effort; solved < topologies if the peer was stopped."""

    level: tuple[int, ...]
    cost: float
    evaluations: int
    topologies: int
    solved: int


def never() -> bool:
    """Return False: never stop."""
    return False


def edges_of(level: tuple[int, ...]) -> list[tuple[int, int]]:
    """Return (observer, subject) pairs; -1 is the global sensor, n the target."""
    robots, last = len(level), max(level)
    edges = [(-1, b) for b in range(robots) if level[b] == 0]
    edges += [(a, b) for a in range(robots) for b in range(robots) if level[b] == level[a] + 1]
    return edges + [(a, robots) for a in range(robots) if level[a] == last]


def neighbours_of(level: tuple[int, ...]) -> list[tuple[int, ...]]:
    """Return each topology that differs by one robot moved one level up or down, once."""
    found: dict[tuple[int, ...], None] = {}
    for robot, own in enumerate(level):
        for to in (own - 1, own + 1):
            moved = [*level[:robot], to, *level[robot + 1 :]]
            kept = sorted(set(moved))
            candidate = tuple(kept.index(k) for k in moved)
            if candidate != level:
                found[candidate] = None
    return list(found)


def brute_force(
    level: tuple[int, ...],
    objective_of: Callable[[tuple[int, ...]], Objective],
    size: int,
    gradient: bool,
    should_stop: Callable[[], bool] = never,
) -> PeerStep:
    """Return the cheapest of a topology and its neighbours, or of those solved before `should_stop` returns True.

    Objectives take controls scaled to [-1, 1] and return the cost, or (cost, gradient) with `gradient`.
    """
    best, evaluations, solved = (np.inf, level), 0, 0
    candidates = [level, *neighbours_of(level)]
    for candidate in candidates:
        if solved and should_stop():
            break
        solved += 1
        objective = objective_of(candidate)
        first = objective(np.zeros(size))
        scale = first[0] if isinstance(first, tuple) else first

        def scaled(x: Array, objective: Objective = objective, scale: float = scale) -> Any:
            value = objective(x)
            return (value[0] / scale, value[1] / scale) if isinstance(value, tuple) else value / scale

        result = minimize(
            scaled,
            np.zeros(size),
            method="L-BFGS-B",
            jac=gradient,
            bounds=[(-1.0, 1.0)] * size,
            options={"gtol": 1e-4, "ftol": 1e-15},
        )
        evaluations += int(result.nfev) + 1
        best = min(best, (float(result.fun) * scale, candidate))
    return PeerStep(best[1], best[0], evaluations, len(candidates), solved)
