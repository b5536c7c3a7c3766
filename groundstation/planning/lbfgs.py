"""Compiled projected L-BFGS on the box of admissible controls."""

import numpy as np

from groundstation.arrays import BoolVector, Matrix, Vector
from groundstation.kernel import kernel
from groundstation.planning.gradient import evaluate
from groundstation.planning.records import CostProblem

MEMORY = 6


@kernel()
def direction(x: Vector, g: Vector, S: Matrix, Y: Matrix, stored: int, free: BoolVector, out: Vector) -> None:
    """Write the L-BFGS descent direction over the variables that are not held by their bound."""
    alphas = np.zeros(MEMORY)
    n = x.shape[0]
    for j in range(n):
        free[j] = not ((x[j] <= -1.0 and g[j] > 0.0) or (x[j] >= 1.0 and g[j] < 0.0))
        out[j] = -g[j] if free[j] else 0.0
    gamma = 0.0
    for back in range(stored):
        s, y = S[back], Y[back]  # newest first
        sy = sq = yy = 0.0
        for j in range(n):
            if free[j]:
                sy += s[j] * y[j]
                sq += s[j] * out[j]
                yy += y[j] * y[j]
        if sy <= 1e-12 * yy or yy == 0.0:
            alphas[back] = np.inf
            continue
        gamma = sy / yy if gamma == 0.0 else gamma
        alphas[back] = sq / sy
        for j in range(n):
            if free[j]:
                out[j] -= alphas[back] * y[j]
    if gamma > 0.0:
        out *= gamma
    for back in range(stored - 1, -1, -1):
        if alphas[back] == np.inf:
            continue
        s, y = S[back], Y[back]
        sy = yq = 0.0
        for j in range(n):
            if free[j]:
                sy += s[j] * y[j]
                yq += y[j] * out[j]
        for j in range(n):
            if free[j]:
                out[j] += (alphas[back] - yq / sy) * s[j]


@kernel()
def projected_gradient(x: Vector, g: Vector) -> float:
    """Return the largest entry of clip(x - g) - x: zero at a stationary point of the box [-1, 1]."""
    worst = 0.0
    for j in range(x.shape[0]):
        worst = max(worst, abs(min(max(x[j] - g[j], -1.0), 1.0) - x[j]))
    return worst


@kernel()
def copy_into(to: Vector, source: Vector) -> None:
    """Copy a vector. (Assigning slices compiles numba's broadcasting errors: 1.5 s for each use.)"""
    for j in range(to.shape[0]):
        to[j] = source[j]


@kernel()
def push(history: Matrix, newest: Vector, before: Vector) -> None:
    """Shift a history by one and put newest - before in front."""
    for row in range(history.shape[0] - 1, 0, -1):
        copy_into(history[row], history[row - 1])
    for j in range(newest.shape[0]):
        history[0, j] = newest[j] - before[j]


@kernel()
def head(x: Vector, g: Vector, S: Matrix, Y: Matrix, stored: int, free: BoolVector, out: Vector) -> int:
    """Write where to go next: the L-BFGS direction, or a bounded step downhill; returns how much history is of use."""
    direction(x, g, S, Y, stored, free, out)
    slope = largest = 0.0
    for j in range(x.shape[0]):
        slope += g[j] * out[j]
    if stored > 0 and slope < 0.0:
        return stored
    for j in range(x.shape[0]):
        out[j] = -g[j] if free[j] else 0.0
        largest = max(largest, abs(out[j]))
    for j in range(x.shape[0]):
        out[j] *= 0.5 / max(largest, 1e-12)
    return 0


@kernel()
def advance(x: Vector, g: Vector, out: Vector, step: float, trial: Vector) -> float:
    """Write the projection of x + step out onto the box; returns the linear prediction g . (trial - x)."""
    expected = 0.0
    for j in range(x.shape[0]):
        trial[j] = min(max(x[j] + step * out[j], -1.0), 1.0)
        expected += g[j] * (trial[j] - x[j])
    return expected


@kernel()
def solve(x: Vector, problem: CostProblem, budget: int, tolerance: float, report: Vector) -> tuple[float, int]:
    """Minimise from x in [-1, 1]^(3 n), u = x * scale, in place; returns (cost, evaluations).

    Stops when the projected gradient of cost / first cost is below the tolerance, when no step improves, or after
    `budget` evaluations; x is always the best point seen. A first cost that is not finite has no direction to go in:
    x stays, and the cost returned is infinite. report: see gradient.evaluate.
    """
    n, m = x.shape[0], report.shape[0]
    g, g_new, out, trial, u, latest = np.empty(n), np.empty(n), np.empty(n), x.copy(), np.empty(n), np.empty(m)
    free, S, Y = np.empty(n, np.bool_), np.zeros((MEMORY, n)), np.zeros((MEMORY, n))
    f, size, expected, step, stored, used = np.inf, 1.0, 0.0, 1.0, 0, 0
    while True:
        for j in range(n):
            u[j] = trial[j] * problem.scale[j]
        f_new = evaluate(u, problem, True, g_new, latest)
        used += 1
        if used == 1:
            size = max(f_new, 1e-12)
            if not np.isfinite(f_new):
                copy_into(report, latest)
                break
        for j in range(n):
            g_new[j] *= problem.scale[j] / size
        if f_new < f and (used == 1 or f_new <= f + 1e-4 * size * expected):
            if used > 1:
                push(S, trial, x)
                push(Y, g_new, g)
                stored = min(stored + 1, MEMORY)
            gain, f, step = (f - f_new) / size, f_new, 1.0
            copy_into(x, trial)
            copy_into(g, g_new)
            copy_into(report, latest)
            if gain < 1e-2 * tolerance or projected_gradient(x, g) <= tolerance:
                break
            stored = head(x, g, S, Y, stored, free, out)
        else:
            step *= 0.3
            if step < 1e-4 and stored == 0:
                break
            if step < 1e-4:
                stored, step = head(x, g, S, Y, 0, free, out), 1.0
        if used >= budget:
            break
        expected = advance(x, g, out, step, trial)
    return f, used
