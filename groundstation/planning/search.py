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


@njit("void(float64[:,::1], float64[::1])", cache=True, nogil=True)
def push(history: Array, newest: Array) -> None:
    """Shift a history by one and put the newest row in front."""
    for row in range(history.shape[0] - 1, 0, -1):
        history[row, :] = history[row - 1]
    history[0, :] = newest


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
    `budget` evaluations; x is always the best point seen.
    """
    n = x.shape[0]
    g, g_new, out, x_new = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    free = np.empty(n, np.bool_)
    S, Y, stored, used = np.zeros((MEMORY, n)), np.zeros((MEMORY, n)), 0, 1
    f = evaluate(x * scale, scale, poses, targets, heights, prior, edges, cameras, markers, options, True, g, report)
    size = max(f, 1e-12)
    g *= scale / size
    while used < budget and projected_gradient(x, g) > tolerance:
        direction(x, g, S, Y, stored, free, out)
        slope = (g * out).sum()
        if slope >= 0.0 or stored == 0:
            stored = 0
            for j in range(n):
                out[j] = -g[j] if free[j] else 0.0
            out *= 0.5 / max(np.abs(out).max(), 1e-12)
        step, f_new, accepted = 1.0, f, False
        while used < budget and step > 1e-4:
            for j in range(n):
                x_new[j] = min(max(x[j] + step * out[j], -1.0), 1.0)
            f_new = evaluate(
                x_new * scale, scale, poses, targets, heights, prior, edges, cameras, markers, options, True, g_new,
                report,
            )  # fmt: skip
            used += 1
            accepted = f_new <= f + 1e-4 * size * (g * (x_new - x)).sum() and f_new < f
            if accepted:
                break
            step *= 0.3
        if not accepted:
            if stored == 0:
                break
            stored = 0
            continue
        g_new *= scale / size
        push(S, x_new - x)
        push(Y, g_new - g)
        stored = min(stored + 1, MEMORY)
        gain = (f - f_new) / size
        f = f_new
        x[:] = x_new
        g[:] = g_new
        if gain < 1e-2 * tolerance:
            break
    evaluate(x * scale, scale, poses, targets, heights, prior, edges, cameras, markers, options, False, g_new, report)
    return f, used + 1
