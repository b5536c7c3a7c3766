"""Finds the minimum of a noisy cost evaluated at a few places, by a parabola wider than its noise."""

from typing import NamedTuple

import numpy as np

from groundstation.arrays import Array


class Least(NamedTuple):
    """A minimum: the tried place nearest to it, its place, and half of the cost's second derivative there."""

    nearest: int
    place: float
    curvature: float


def least(places: Array, costs: Array, reach: int) -> Least | None:
    """Return the minimum of costs at places, fitted to `reach` places to each side of the best; None at the edge.

    A curvature of 0 or less means that the costs have no minimum; `place` is then NaN.
    """
    best = int(np.argmin(costs))
    if best in (0, len(costs) - 1):
        return None
    near = slice(max(0, best - reach), best + reach + 1)
    a, b, _ = np.polyfit(places[near], costs[near], 2)
    return Least(best, float(-b / (2.0 * a)) if a > 0.0 else float("nan"), float(a))
