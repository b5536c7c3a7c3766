"""Compiled projected L-BFGS on the box of admissible controls."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from groundstation.planning.gradient import evaluate

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

MEMORY = 6


@njit(
    "void(float64[::1], float64[::1], float64[:,::1], float64[:,::1], int64, boolean[::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def direction(x: Array, g: Array, S: Array, Y: Array, stored: int, free: NDArray[np.bool_], out: Array) -> None:
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


@njit("float64(float64[::1], float64[::1])", cache=True, nogil=True)
def projected_gradient(x: Array, g: Array) -> float:
    """Return the largest entry of clip(x - g) - x: zero at a stationary point of the box [-1, 1]."""
    worst = 0.0
    for j in range(x.shape[0]):
        worst = max(worst, abs(min(max(x[j] - g[j], -1.0), 1.0) - x[j]))
    return worst


@njit("void(float64[::1], float64[::1])", cache=True, nogil=True)
def copy_into(to: Array, source: Array) -> None:
    """Copy a vector. (Assigning slices compiles numba's broadcasting errors: 1.5 s for each use.)"""
    for j in range(to.shape[0]):
        to[j] = source[j]


@njit("void(float64[:,::1], float64[::1], float64[::1])", cache=True, nogil=True)
def push(history: Array, newest: Array, before: Array) -> None:
    """Shift a history by one and put newest - before in front."""
    for row in range(history.shape[0] - 1, 0, -1):
        copy_into(history[row], history[row - 1])
    for j in range(newest.shape[0]):
        history[0, j] = newest[j] - before[j]


@njit(
    "int64(float64[::1], float64[::1], float64[:,::1], float64[:,::1], int64, boolean[::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def head(x: Array, g: Array, S: Array, Y: Array, stored: int, free: NDArray[np.bool_], out: Array) -> int:
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


@njit("float64(float64[::1], float64[::1], float64[::1], float64, float64[::1])", cache=True, nogil=True)
def advance(x: Array, g: Array, out: Array, step: float, trial: Array) -> float:
    """Write the projection of x + step out onto the box; returns the linear prediction g . (trial - x)."""
    expected = 0.0
    for j in range(x.shape[0]):
        trial[j] = min(max(x[j] + step * out[j], -1.0), 1.0)
        expected += g[j] * (trial[j] - x[j])
    return expected


@njit(
    "Tuple((float64, int64))(float64[::1], float64[::1], float64[:,::1], float64[:,::1], float64[:,::1], "
    "float64[:,::1], int64[:,::1], float64[:,::1], float64[::1], float64[::1], int64, float64, float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def solve(
    x: Array,
    scale: Array,
    poses: Array,
    targets: Array,
    heights: Array,
    prior: Array,
    edges: Indices,
    cameras: Array,
    markers: Array,
    options: Array,
    budget: int,
    tolerance: float,
    report: Array,
) -> tuple[float, int]:
    """Minimise from x in [-1, 1]^(3 n), u = x * scale, in place; returns (cost, evaluations).

    Stops when the projected gradient of cost / first cost is below the tolerance, when no step improves, or after
    `budget` evaluations; x is always the best point seen. report: see gradient.evaluate.
    """
    n, m = x.shape[0], report.shape[0]
    g, g_new, out, trial, u, latest = np.empty(n), np.empty(n), np.empty(n), x.copy(), np.empty(n), np.empty(m)
    free, S, Y = np.empty(n, np.bool_), np.zeros((MEMORY, n)), np.zeros((MEMORY, n))
    f, size, expected, step, stored, used = np.inf, 1.0, 0.0, 1.0, 0, 0
    while True:
        for j in range(n):
            u[j] = trial[j] * scale[j]
        f_new = evaluate(
            u, scale, poses, targets, heights, prior, edges, cameras, markers, options, True, g_new, latest
        )
        used += 1
        if used == 1:
            size = max(f_new, 1e-12)
        for j in range(n):
            g_new[j] *= scale[j] / size
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
