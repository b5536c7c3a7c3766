"""Finds neighbours with the same optimal controls as the current topology: no step helps, within the tolerance.

In a large team most survivors of the bounds are found to be such, each with one evaluation. `moved` gives the same
result up to the square of a robot's share; its error is taken from an evaluated move between the same levels.
"""

import math

import numpy as np

from groundstation.arrays import IntVector, Matrix, Vector
from groundstation.experiments.planar.moved import evaluate, look, moved_cost, moved_robot
from groundstation.experiments.planar.records import Optimum, PlanarProblem, Workspace
from groundstation.kernel import kernel
from groundstation.planning.lbfgs import projected_gradient

_FEW = 4  # topologies that must be found to be such before the estimate pays
_DOUBT = 3.0  # times the errors that were found for a like move
_EXACT = 1e-4  # error of a cost, over the current one, up to which it is taken


@kernel()
def _kind(before: IntVector, after: IntVector) -> int:
    """Return the kind of a move: alike for robots that leave the same level to the same side; -1 for no move."""
    robot = moved_robot(before, after)
    if robot < 0:
        return -1
    return 2 * int(before[robot]) + (1 if after[robot] > before[robot] else 0)


@kernel()
def learn(
    level: IntVector, exact: float, found: int, at: Optimum, cost: float, problem: PlanarProblem, work: Workspace,
    doubt: Matrix,
) -> int:  # fmt: skip
    """Measure, once, the error of `moved` for a kind of move, by one that was evaluated; return evaluations.

    found: number of topologies with the current one's optimum, this one too; exact, cost: of this one and of the
    current one, both there [m^2]. doubt (2n, 2): errors of cost and gradient over the current cost, for each kind of
    move, and for an imbalance of 1; infinite where nothing is known.
    """
    kind, looks = _kind(at.level, level), 1 if found == _FEW else 0
    if looks == 1:
        look(at, problem, work)
    if found < _FEW or kind < 0 or np.isfinite(doubt[kind, 0]):
        return looks
    expected, true, worst = np.empty(at.controls.shape[0]), np.empty(at.controls.shape[0]), 0.0
    value, imbalance = moved_cost(level, at, cost, problem, expected)
    evaluate(level, at.controls, problem, work, true)
    for k in range(true.shape[0]):
        worst = max(worst, abs(expected[k] - true[k]))
    imbalance = max(imbalance / cost, 1e-300)
    doubt[kind, 0] = _DOUBT * max(exact - value, 0.0) / (cost * imbalance)
    doubt[kind, 1] = _DOUBT * worst / (cost * math.sqrt(imbalance))
    return looks + 1


@kernel()
def resting_cost(
    level: IntVector, at: Optimum, cost: float, problem: PlanarProblem, tolerance: float, doubt: Matrix
) -> float:
    """Return a lower bound of a topology's cost at the current optimum [m^2]; NaN if it may be better elsewhere.

    cost: the current topology's; tolerance: of the projected gradient over that cost.
    """
    kind = _kind(at.level, level)
    if kind < 0 or not np.isfinite(doubt[kind, 0]):
        return np.nan
    gradient = np.empty(at.controls.shape[0])
    value, imbalance = moved_cost(level, at, cost, problem, gradient)
    imbalance /= cost
    for k in range(gradient.shape[0]):
        gradient[k] /= cost
    slope = projected_gradient(at.controls, gradient) + doubt[kind, 1] * math.sqrt(imbalance)
    return value if doubt[kind, 0] * imbalance <= _EXACT and slope <= tolerance else np.nan


@kernel()
def take_controls(at: Optimum, controls: Vector) -> None:
    """Copy the current topology's controls."""
    for k in range(controls.shape[0]):
        controls[k] = at.controls[k]
