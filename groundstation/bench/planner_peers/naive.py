"""The planner that a lab would write first: an EKF rollout over all 2(n + 1) coordinates, finite differences, SciPy."""

from collections.abc import Callable

import numpy as np

from groundstation.arrays import Array
from groundstation.bench.planner_peers.step import Objective, PeerStep, brute_force, edges_of, never
from groundstation.experiments.planar.parameters import PlanarParameters


def rollout_cost(
    x: Array, mean: Array, covariance: Array, edges: list[tuple[int, int]], parameters: PlanarParameters
) -> float:
    """Return the discounted trace of the target's covariance under scaled controls x (2n) [m^2].

    covariance (2N, 2N) over (x0, y0, x1, y1, ...). Every step predicts, then updates with all readings stacked.
    """
    positions, p = mean.copy(), covariance.copy()
    noise = np.diag(np.repeat(parameters.process_variance(len(mean) - 1), 2))
    velocity = np.vstack([x.reshape(-1, 2) * parameters.max_speed_m_s, parameters.target_velocity_m_s])
    total, weight = 0.0, 1.0
    for _ in range(parameters.steps):
        positions = positions + parameters.step_s * velocity
        p = p + noise
        h, r = _stacked_readings(positions, edges, parameters)
        s = h @ p @ h.T + np.diag(r)
        gain = np.linalg.solve(s, h @ p).T
        p = (np.eye(len(p)) - gain @ h) @ p
        weight *= parameters.discount
        total += weight * float(np.trace(p[-2:, -2:]))
    return total


def _stacked_readings(
    positions: Array, edges: list[tuple[int, int]], parameters: PlanarParameters
) -> tuple[Array, Array]:
    h, r = np.zeros((2 * len(edges), 2 * len(positions))), np.empty(2 * len(edges))
    for row, (observer, subject) in enumerate(edges):
        offset = positions[subject] - (positions[observer] if observer >= 0 else 0.0)
        for axis in range(2):
            h[2 * row + axis, 2 * subject + axis] = 1.0
            if observer >= 0:
                h[2 * row + axis, 2 * observer + axis] = -1.0
        distance = np.hypot(np.hypot(*offset), parameters.epsilon_m)
        exponent = min((distance - parameters.range_m) / parameters.softness_m, 40.0)
        r[2 * row : 2 * row + 2] = parameters.sigma_m**2 * (1.0 + np.exp(exponent))
    return h, r


def solve(
    mean: Array,
    covariance: Array,
    level: tuple[int, ...],
    parameters: PlanarParameters,
    should_stop: Callable[[], bool] = never,
) -> PeerStep:
    """Return one control step for a belief with per-axis covariance (N, N)."""
    full: Array = np.kron(covariance, np.eye(2)).astype(np.float64)

    def objective_of(candidate: tuple[int, ...]) -> Objective:
        edges = edges_of(candidate)
        return lambda x: rollout_cost(x, mean, full, edges, parameters)

    return brute_force(level, objective_of, 2 * len(level), False, should_stop)
