"""Projected L-BFGS in the box [-1, 1]^m, compiled around the planning cost."""

import numpy as np

from groundstation.arrays import Matrix, Vector
from groundstation.experiments.planar.objective import cost_and_gradient
from groundstation.experiments.planar.records import Limits, PlanarProblem, Workspace
from groundstation.kernel import kernel

MEMORY = 8
ARMIJO = 1e-4
CONVERGED, OUT_OF_BUDGET, NO_PROGRESS, FAILED = 0, 1, 2, 3


@kernel()
def projected_gradient_norm(x: Vector, gradient: Vector) -> float:
    """Return max |clip(x - g) - x|, zero at a constrained stationary point."""
    largest = 0.0
    for k in range(x.shape[0]):
        largest = max(largest, abs(min(1.0, max(-1.0, x[k] - gradient[k])) - x[k]))
    return largest


@kernel(contract=True, reassociate=True)
def _direction(x: Vector, gradient: Vector, steps: Matrix, changes: Matrix, used: int, direction: Vector) -> None:
    """Write the quasi-Newton descent direction in the subspace of variables that are free to move.

    Two-loop recursion in which steps and changes are projected onto the free subspace; a pair whose curvature
    vanishes there is skipped.
    """
    m = x.shape[0]
    free = np.empty(m)
    alpha, curvature = np.empty(MEMORY), np.empty(MEMORY)
    for k in range(m):
        held = (x[k] <= -1.0 and gradient[k] > 0.0) or (x[k] >= 1.0 and gradient[k] < 0.0)
        free[k] = 0.0 if held else 1.0
        direction[k] = -free[k] * gradient[k]
    scale = 1.0
    for j in range(used - 1, -1, -1):
        product, square, alpha[j] = 0.0, 0.0, 0.0
        for k in range(m):
            change = free[k] * changes[j, k]
            product += steps[j, k] * change
            square += change * change
            alpha[j] += steps[j, k] * direction[k]
        curvature[j] = product if product > 1e-10 * square else 0.0
        if curvature[j] == 0.0:
            continue
        if scale == 1.0:
            scale = product / square
        alpha[j] /= product
        for k in range(m):
            direction[k] -= alpha[j] * free[k] * changes[j, k]
    for k in range(m):
        direction[k] *= scale
    for j in range(used):
        if curvature[j] == 0.0:
            continue
        beta = 0.0
        for k in range(m):
            beta += changes[j, k] * direction[k]
        beta /= curvature[j]
        for k in range(m):
            direction[k] += free[k] * (alpha[j] - beta) * steps[j, k]
    if np.dot(direction, gradient) >= 0.0:
        for k in range(m):
            direction[k] = -free[k] * gradient[k]


@kernel()
def _remember(
    x: Vector, trial: Vector, gradient: Vector, trial_gradient: Vector, steps: Matrix, changes: Matrix, used: int
) -> int:
    """Append a step and its gradient change if their curvature is positive; return how many are kept."""
    curvature, size = 0.0, 0.0
    for k in range(x.shape[0]):
        curvature += (trial[k] - x[k]) * (trial_gradient[k] - gradient[k])
        size += (trial_gradient[k] - gradient[k]) ** 2
    if curvature <= 1e-10 * size:
        return used
    if used == MEMORY:
        steps[:-1] = steps[1:].copy()
        changes[:-1] = changes[1:].copy()
        used -= 1
    for k in range(x.shape[0]):
        steps[used, k] = trial[k] - x[k]
        changes[used, k] = trial_gradient[k] - gradient[k]
    return used + 1


@kernel()
def minimise(
    x: Vector, problem: PlanarProblem, work: Workspace, scale: float, limits: Limits
) -> tuple[float, int, int]:
    """Minimise cost / scale of the workspace's topology from x, in place; scale 0 stands for the cost at x.

    Returns (cost [m^2], evaluations, status); converged when max |clip(x - g) - x| <= tolerance.
    """
    m = x.shape[0]
    gradient, trial, trial_gradient, direction = np.empty(m), np.empty(m), np.empty(m), np.empty(m)
    steps, changes = np.empty((MEMORY, m)), np.empty((MEMORY, m))
    value = cost_and_gradient(x, problem, work, gradient)
    if value < 0.0:
        return value, 1, FAILED
    scale = value if scale == 0.0 else scale
    gradient /= scale
    evaluations, used = 1, 0
    while projected_gradient_norm(x, gradient) > limits.tolerance:
        _direction(x, gradient, steps, changes, used, direction)
        length = 1.0 if used > 0 else 0.5 / np.max(np.abs(direction))
        accepted = False
        for _ in range(20):
            if evaluations >= limits.budget or limits.stop[0] != 0:
                return value, evaluations, OUT_OF_BUDGET
            slope = 0.0
            for k in range(m):
                trial[k] = min(1.0, max(-1.0, x[k] + length * direction[k]))
                slope += gradient[k] * (trial[k] - x[k])
            trial_value = cost_and_gradient(trial, problem, work, trial_gradient)
            evaluations += 1
            if trial_value >= 0.0 and (trial_value - value) / scale <= ARMIJO * slope:
                accepted = True
                break
            length *= 0.4
        if not accepted:
            return value, evaluations, NO_PROGRESS
        trial_gradient /= scale
        used = _remember(x, trial, gradient, trial_gradient, steps, changes, used)
        x[:], gradient[:], value = trial, trial_gradient, trial_value
    return value, evaluations, CONVERGED
