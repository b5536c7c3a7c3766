"""A planner as a JAX user would write it: reduced state, jit + grad, all topologies in lockstep under vmap.

Needs the optional extra `jax`. Known to dead-lock now and then at 30 robots (batched LAPACK inside a jitted loop):
run it in a process of its own, with a time-out.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from groundstation.arrays import Array
from groundstation.bench.planner_peers.step import PeerStep, edges_of, neighbours_of, never
from groundstation.experiments.planar.parameters import PlanarParameters

_ITERATIONS = 100
_STEPS = tuple(0.5**k for k in range(8))


@cache
def _solver(parameters: PlanarParameters) -> Any:
    """Return the jitted batch solver: (adjacency (K, N + 1, N + 1), mean, prior, variance) -> costs (K), controls."""
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    p = parameters

    def cost(x: Any, adjacency: Any, mean: Any, information: Any, variance: Any) -> Any:
        velocity = jnp.vstack([x.reshape(-1, 2) * p.max_speed_m_s, jnp.array([p.target_velocity_m_s])])
        d, total = jnp.diag(1.0 / variance), 0.0
        for i in range(1, p.steps + 1):
            position = jnp.vstack([mean + i * p.step_s * velocity, jnp.zeros((1, 2))])
            offset = position[:, None] - position[None]
            distance = jnp.sqrt((offset**2).sum(-1) + p.epsilon_m**2)
            exponent = jnp.minimum((distance - p.range_m) / p.softness_m, 40.0)
            w = adjacency / (p.sigma_m**2 * (1.0 + jnp.exp(exponent)))
            laplacian = jnp.diag(w.sum(1)) - w
            posterior = information + laplacian[:-1, :-1]
            total += 2.0 * p.discount**i * jnp.linalg.inv(posterior)[-1, -1]
            information = d - d @ jnp.linalg.inv(posterior + d) @ d
        return total

    both = jax.value_and_grad(cost)

    def solve(adjacency: Any, mean: Any, information: Any, variance: Any) -> Any:
        start = jnp.zeros(2 * (mean.shape[0] - 1))
        scale = cost(start, adjacency, mean, information, variance)

        def scaled(x: Any) -> Any:
            value, gradient = both(x, adjacency, mean, information, variance)
            return value / scale, gradient / scale

        def move(state: Any) -> Any:
            x, value, gradient, length, k = state
            trials = jnp.clip(x - (length * jnp.array(_STEPS))[:, None] * gradient, -1.0, 1.0)
            values, gradients = jax.vmap(scaled)(trials)
            best = jnp.argmin(values)
            step, change = trials[best] - x, gradients[best] - gradient
            curvature = step @ change
            longer = jnp.where(curvature > 0, (step @ step) / jnp.where(curvature > 0, curvature, 1.0), length * 2.0)
            better = values[best] < value
            return (
                jnp.where(better, trials[best], x),
                jnp.where(better, values[best], value),
                jnp.where(better, gradients[best], gradient),
                jnp.where(better, 4.0 * longer, length * 0.01),
                k + 1,
            )

        def unfinished(state: Any) -> Any:
            x, _, gradient, _, k = state
            return (jnp.abs(jnp.clip(x - gradient, -1.0, 1.0) - x).max() > 1e-4) & (k < _ITERATIONS)

        value, gradient = scaled(start)
        first = 0.5 / jnp.maximum(jnp.abs(gradient).max(), 1e-12)
        _, value, _, _, k = jax.lax.while_loop(unfinished, move, (start, value, gradient, first, 0))
        return value * scale, k

    return jax.jit(jax.vmap(solve, in_axes=(0, None, None, None)))


def solve(
    mean: Array,
    covariance: Array,
    level: tuple[int, ...],
    parameters: PlanarParameters,
    should_stop: Callable[[], bool] = never,
) -> PeerStep:
    """Return one control step for a belief with per-axis covariance (N, N); raises ImportError without jax.

    The batch is solved in lockstep and cannot be stopped half-way. The first call for a team size compiles.
    """
    candidates = [level, *neighbours_of(level)]
    size = len(mean)
    adjacency = np.zeros((2 * len(level) + 1, size + 1, size + 1))
    for k, candidate in enumerate(candidates):
        for a, b in edges_of(candidate):
            row = size if a < 0 else a
            adjacency[k, row, b] = adjacency[k, b, row] = 1.0
    adjacency[len(candidates) :] = adjacency[0]
    variance = parameters.process_variance(size - 1)
    costs, counts = _solver(parameters)(adjacency, mean, np.linalg.inv(covariance + np.diag(variance)), variance)
    costs = np.asarray(costs)[: len(candidates)]
    best = int(costs.argmin())
    evaluations = int(np.asarray(counts).max()) * len(_STEPS) * len(candidates)
    return PeerStep(candidates[best], float(costs[best]), evaluations, len(candidates), len(candidates))
