"""The same mathematics as the compiled planner in plain numpy: reduced state, information form, exact adjoint."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.arrays import Array
from groundstation.bench.planner_peers.step import Objective, PeerStep, brute_force, edges_of, never
from groundstation.experiments.planar.parameters import PlanarParameters


class Rollout:
    """Cost and gradient of one topology; complex controls are allowed, so that complex steps can check gradients."""

    def __init__(self, mean: Array, covariance: Array, level: tuple[int, ...], parameters: PlanarParameters) -> None:
        self.mean, self.parameters = mean, parameters
        self.edges = edges_of(level)
        self.incidence = np.zeros((len(self.edges), len(mean)))
        for row, (observer, subject) in enumerate(self.edges):
            self.incidence[row, subject] = 1.0
            if observer >= 0:
                self.incidence[row, observer] = -1.0
        self.variance = parameters.process_variance(len(mean) - 1)
        self.prior = np.linalg.inv(covariance + np.diag(self.variance))

    def weights(self, positions: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """Return edge information w, its derivative dw/dd, and offset / distance (m, 2)."""
        p = self.parameters
        offset = self.incidence @ positions
        distance = np.sqrt((offset**2).sum(axis=1) + p.epsilon_m**2)
        exponent = (distance - p.range_m) / p.softness_m
        exponent = np.where(exponent.real > 40.0, 40.0, exponent)
        w = 1.0 / (p.sigma_m**2 * (1.0 + np.exp(exponent)))
        return w, -w * (1.0 - p.sigma_m**2 * w) / p.softness_m, offset / distance[:, None]

    def cost(self, x: NDArray[Any]) -> Any:
        """Return the cost [m^2] of scaled controls x (2n), real or complex."""
        total, information, weight = 0.0, self.prior, 1.0
        for i in range(1, self.parameters.steps + 1):
            w, _, _ = self.weights(self._positions(x, i))
            posterior = information + (self.incidence.T * w) @ self.incidence
            weight *= self.parameters.discount
            total = total + 2.0 * weight * np.linalg.inv(posterior)[-1, -1]
            information = self._predict(posterior)
        return total

    def cost_and_gradient(self, x: Array) -> tuple[float, Array]:
        """Return the cost [m^2] and its gradient in x (2n) by the rank-one adjoint."""
        p, information, weight, total = self.parameters, self.prior, 1.0, 0.0
        tape: list[Any] = []
        for i in range(1, p.steps + 1):
            w, dw, direction = self.weights(self._positions(x, i))
            posterior = information + (self.incidence.T * w) @ self.incidence
            weight *= p.discount
            total += 2.0 * weight * np.linalg.inv(posterior)[-1, -1]
            tape.append((information, posterior, dw, direction, weight))
            information = self._predict(posterior)
        gradient, columns = np.zeros((len(self.mean), 2)), np.empty((len(self.mean), 0))
        for i in range(p.steps, 0, -1):
            information, posterior, dw, direction, weight = tape[i - 1]
            seed = np.zeros((len(self.mean), 1))
            seed[-1] = np.sqrt(2.0 * weight)
            y = np.linalg.solve(posterior, np.hstack([columns, seed]))
            sensitivity = -((self.incidence @ y) ** 2).sum(axis=1)
            gradient += self.incidence.T @ ((sensitivity * dw)[:, None] * direction) * (i * p.step_s)
            columns = information @ y
        return float(total), gradient[:-1].ravel() * p.max_speed_m_s

    def _positions(self, x: NDArray[Any], step: int) -> NDArray[Any]:
        p = self.parameters
        velocity = np.vstack([x.reshape(-1, 2) * p.max_speed_m_s, p.target_velocity_m_s])
        return np.asarray(self.mean + step * p.step_s * velocity)

    def _predict(self, posterior: NDArray[Any]) -> NDArray[Any]:
        d = np.diag(1.0 / self.variance)
        return np.asarray(d - d @ np.linalg.inv(posterior + d) @ d)


def solve(
    mean: Array,
    covariance: Array,
    level: tuple[int, ...],
    parameters: PlanarParameters,
    should_stop: Callable[[], bool] = never,
) -> PeerStep:
    """Return one control step for a belief with per-axis covariance (N, N)."""

    def objective_of(candidate: tuple[int, ...]) -> Objective:
        return Rollout(mean, covariance, candidate, parameters).cost_and_gradient

    return brute_force(level, objective_of, 2 * len(level), True, should_stop)
