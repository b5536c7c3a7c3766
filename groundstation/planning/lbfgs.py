"""Compiled projected L-BFGS in the box [-1, 1]^m, point by point: the caller computes cost and gradient of each.

Used by both planners: the one that flies, and the planar one (`experiments/planar`).
"""

from typing import Any, NamedTuple

import numpy as np

from groundstation.arrays import Matrix, Vector
from groundstation.kernel import Record, Rows, kernel

MEMORY = 6
_ARMIJO = 1e-4
_SHORTER, _SHORTEST = 0.3, 1e-4  # factor for a step that does not help; below the latter the direction is given up
_FIRST = 0.5  # largest entry of a first step, when nothing is known of the curvature
_FLAT = 1e-10  # a pair of step and change with less curvature is of no use


class Progress(Record):
    """Progress of a descent.

    cost: at x; size: divisor of costs and gradients (0: the first cost); expected: predicted change of cost at the next
    point, over size; step: length along the direction; stored: rows of history; evaluations: so far; over: 1 once x
    counts as a minimum.
    """

    cost: float
    size: float
    expected: float
    step: float
    stored: int
    evaluations: int
    over: int


_PROGRESS = Progress.dtype


class Descent(NamedTuple):
    """A search that can be continued: the best point x, the next one to evaluate, `trial`, and their gradients.

    free (m): 0 for entries held at their bound, else 1; steps, changes (MEMORY, m): history of x and of its gradient,
    newest first; progress (1).
    """

    x: Vector
    gradient: Vector
    trial: Vector
    trial_gradient: Vector
    direction: Vector
    free: Vector
    steps: Matrix
    changes: Matrix
    progress: Rows[Progress]


@kernel()
def descent_from(start: Vector, size: float) -> Descent:
    """Return the search that begins at the point of the box nearest to a start; size: see Progress."""
    m = start.shape[0]
    x, trial = np.empty(m), np.empty(m)
    progress: Any = np.zeros(1, _PROGRESS)
    for k in range(m):
        x[k] = trial[k] = min(max(start[k], -1.0), 1.0)
    progress[0].cost, progress[0].size, progress[0].step = np.inf, size, 1.0
    return Descent(
        x, np.empty(m), trial, np.empty(m), np.empty(m), np.empty(m), np.zeros((MEMORY, m)), np.zeros((MEMORY, m)),
        progress,
    )  # fmt: skip


@kernel()
def projected_gradient(x: Vector, gradient: Vector) -> float:
    """Return the largest entry of |clip(x - g) - x|: zero at a stationary point of the box."""
    worst = 0.0
    for k in range(x.shape[0]):
        worst = max(worst, abs(min(max(x[k] - gradient[k], -1.0), 1.0) - x[k]))
    return worst


@kernel(contract=True, reassociate=True)
def newton(d: Descent, stored: int) -> float:
    """Write the quasi-Newton direction over the free entries; returns its slope (0: no history).

    Two-loop recursion with history projected onto them; a pair whose curvature vanishes there is skipped.
    """
    x, g, free, out, m = d.x, d.gradient, d.free, d.direction, d.x.shape[0]
    alpha, curvature = np.empty(MEMORY), np.empty(MEMORY)
    for k in range(m):
        held = (x[k] <= -1.0 and g[k] > 0.0) or (x[k] >= 1.0 and g[k] < 0.0)
        free[k] = 0.0 if held else 1.0
        out[k] = -free[k] * g[k]
    scale = 0.0
    for row in range(stored):
        s, y = d.steps[row], d.changes[row]
        along = square = alpha[row] = 0.0
        for k in range(m):
            change = free[k] * y[k]
            along += s[k] * change
            square += change * change
            alpha[row] += s[k] * out[k]
        curvature[row] = along if along > _FLAT * square else 0.0
        if curvature[row] == 0.0:
            continue
        scale = along / square if scale == 0.0 else scale
        alpha[row] /= along
        for k in range(m):
            out[k] -= alpha[row] * free[k] * y[k]
    for k in range(m):
        out[k] *= scale
    for row in range(stored - 1, -1, -1):
        if curvature[row] == 0.0:
            continue
        s, y = d.steps[row], d.changes[row]
        beta = 0.0
        for k in range(m):
            beta += y[k] * out[k]
        beta = alpha[row] - beta / curvature[row]
        for k in range(m):
            out[k] += free[k] * beta * s[k]
    slope = 0.0
    for k in range(m):
        slope += g[k] * out[k]
    return slope


@kernel()
def head(d: Descent, stored: int) -> int:
    """Write the next direction: by the history, else a bounded step downhill; returns the used rows of history."""
    largest = 0.0
    if newton(d, stored) < 0.0:
        return stored
    for k in range(d.x.shape[0]):
        d.direction[k] = -d.free[k] * d.gradient[k]
        largest = max(largest, abs(d.direction[k]))
    for k in range(d.x.shape[0]):
        d.direction[k] *= _FIRST / max(largest, 1e-12)
    return 0


@kernel()
def push(history: Matrix, newest: Vector, before: Vector) -> None:
    """Shift a history by one and put newest - before in front."""
    for row in range(history.shape[0] - 1, 0, -1):
        for k in range(newest.shape[0]):
            history[row, k] = history[row - 1, k]
    for k in range(newest.shape[0]):
        history[0, k] = newest[k] - before[k]


@kernel()
def move(d: Descent) -> int:
    """Make the trial the best point; returns the rows of history.

    A step with negative curvature is not stored: alone it would make the next step as short as the gradient, which is
    smallest where the cost is flat, far from the targets.
    """
    stored, along, square = int(d.progress[0].stored), 0.0, 0.0
    if d.progress[0].evaluations > 1:
        for k in range(d.x.shape[0]):
            change = d.trial_gradient[k] - d.gradient[k]
            along += (d.trial[k] - d.x[k]) * change
            square += change * change
    if along > _FLAT * square:
        push(d.steps, d.trial, d.x)
        push(d.changes, d.trial_gradient, d.gradient)
        stored = min(stored + 1, MEMORY)
    for k in range(d.x.shape[0]):
        d.x[k], d.gradient[k] = d.trial[k], d.trial_gradient[k]
    return stored


@kernel()
def propose(d: Descent) -> None:
    """Write the next trial: x and a step along the direction, projected onto the box."""
    progress, expected = d.progress[0], 0.0
    for k in range(d.x.shape[0]):
        d.trial[k] = min(max(d.x[k] + progress.step * d.direction[k], -1.0), 1.0)
        expected += d.gradient[k] * (d.trial[k] - d.x[k])
    progress.expected = expected


@kernel()
def take(d: Descent, cost: float, tolerance: float, least_gain: float) -> bool:
    """Take the cost of the trial, whose gradient the caller has written; returns whether it is the best so far.

    The search is over when the projected gradient of cost / size is within the tolerance, when a step gains less than
    least_gain of size, or when no step helps. A first cost that is not finite gives no direction: x stays.
    """
    progress = d.progress[0]
    progress.evaluations += 1
    first = progress.evaluations == 1
    if first and not np.isfinite(cost):
        progress.over = 1
        return True
    if progress.size == 0.0:
        progress.size = max(cost, 1e-12)
    size, before = progress.size, progress.cost
    for k in range(d.x.shape[0]):
        d.trial_gradient[k] /= size
    better = cost < before and (first or cost <= before + _ARMIJO * size * progress.expected)
    if better:
        progress.stored, progress.cost, progress.step = move(d), cost, 1.0
        if before - cost < least_gain * size or projected_gradient(d.x, d.gradient) <= tolerance:
            progress.over = 1
            return True
        progress.stored = head(d, progress.stored)
    else:
        progress.step *= _SHORTER
        if progress.step < _SHORTEST:
            progress.over = 1 if progress.stored == 0 else 0
            progress.stored, progress.step = head(d, 0), 1.0
    propose(d)
    return better
