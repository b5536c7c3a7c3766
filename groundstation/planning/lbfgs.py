"""Compiled projected L-BFGS on the box of admissible controls."""

from typing import NamedTuple

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


class SearchState(NamedTuple):
    """A local search that can be continued: best point x with gradient g, next point `trial`, and its history.

    numbers: cost at x, first cost, expected change, step, rows of history, evaluations, whether it is over.
    """

    x: Vector
    g: Vector
    g_new: Vector
    out: Vector
    trial: Vector
    u: Vector
    latest: Vector
    report: Vector
    free: BoolVector
    S: Matrix
    Y: Matrix
    numbers: Vector


def search_state(start: Vector, report_size: int) -> SearchState:
    """Return the state of a search that begins at a start in [-1, 1]^(4 n)."""
    x: Vector = np.clip(start, -1.0, 1.0)
    n = x.size
    g, g_new, out, u = (np.empty(n) for _ in range(4))
    numbers = np.array([np.inf, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    return SearchState(
        x, g, g_new, out, x.copy(), u, np.empty(report_size), np.empty(report_size),
        np.empty(n, np.bool_), np.zeros((MEMORY, n)), np.zeros((MEMORY, n)), numbers,
    )  # fmt: skip


@kernel()
def solve(state: SearchState, problem: CostProblem, budget: int, limit: int, tolerance: float) -> bool:
    """Minimise over x in [-1, 1]^(4 n), u = x * scale, for `budget` further evaluations; returns whether it is over.

    It is over when the projected gradient of cost / first cost is below the tolerance, when no step improves, or after
    `limit` evaluations in all; x is always the best point seen. A first cost that is not finite has no direction to go
    in: x stays, and the cost is infinite. report: see gradient.evaluate.
    """
    x, g, g_new, out, trial, numbers = state.x, state.g, state.g_new, state.out, state.trial, state.numbers
    n, free, S, Y = x.shape[0], state.free, state.S, state.Y
    f, size, expected, step, stored, used = numbers[0], numbers[1], numbers[2], numbers[3], int(numbers[4]), 0
    before, over = int(numbers[5]), bool(numbers[6] > 0.0)
    while used < budget and not over:
        for j in range(n):
            state.u[j] = trial[j] * problem.scale[j]
        f_new = evaluate(state.u, problem, True, g_new, state.latest)
        used += 1
        first = before + used == 1
        if first:
            size = max(f_new, 1e-12)
            if not np.isfinite(f_new):
                copy_into(state.report, state.latest)
                over = True
                break
        for j in range(n):
            g_new[j] *= problem.scale[j] / size
        if f_new < f and (first or f_new <= f + 1e-4 * size * expected):
            if not first:
                push(S, trial, x)
                push(Y, g_new, g)
                stored = min(stored + 1, MEMORY)
            gain, f, step = (f - f_new) / size, f_new, 1.0
            copy_into(x, trial)
            copy_into(g, g_new)
            copy_into(state.report, state.latest)
            if gain < 1e-2 * tolerance or projected_gradient(x, g) <= tolerance:
                over = True
                break
            stored = head(x, g, S, Y, stored, free, out)
        else:
            step *= 0.3
            if step < 1e-4 and stored == 0:
                over = True
                break
            if step < 1e-4:
                stored, step = head(x, g, S, Y, 0, free, out), 1.0
        over = bool(before + used >= limit)
        expected = advance(x, g, out, step, trial)
    numbers[0], numbers[1], numbers[2], numbers[3], numbers[4] = f, size, expected, step, stored
    numbers[5], numbers[6] = before + used, 1.0 if over else 0.0
    return over
