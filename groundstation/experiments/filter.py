"""Kalman filter of the planar simulation: isotropic, so one covariance serves both axes.

State per axis: n robots, the target, and (if it is modelled) the target's velocity.
"""

from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array


@dataclass(frozen=True, slots=True)
class PlanarBelief:
    """mean (m, 2) [m; m/s], covariance (m, m) per axis; entries: robots, target, then target velocity if modelled."""

    mean: Array
    covariance: Array
    robots: int

    @property
    def positions(self) -> Array:
        """Return the mean of robots and target (n + 1, 2) [m]."""
        return self.mean[: self.robots + 1]

    @property
    def position_covariance(self) -> Array:
        """Return the per-axis covariance of robots and target (n + 1, n + 1) [m^2]."""
        return np.ascontiguousarray(self.covariance[: self.robots + 1, : self.robots + 1])

    @property
    def target_velocity(self) -> Array:
        """Return the mean velocity of the target (2) [m/s], zero if it is not modelled."""
        return self.mean[self.robots + 1] if len(self.mean) > self.robots + 1 else np.zeros(2)

    @property
    def target_trace(self) -> float:
        """Return the trace of the target's position covariance [m^2]."""
        return 2.0 * float(self.covariance[self.robots, self.robots])


def initial_belief(positions: Array, variance: float, target_velocity: bool) -> PlanarBelief:
    """Return a belief at known positions (n + 1, 2) with one variance on every entry."""
    robots = len(positions) - 1
    mean = np.vstack([positions, np.zeros((int(target_velocity), 2))])
    return PlanarBelief(mean, variance * np.eye(len(mean)), robots)


def predict(belief: PlanarBelief, velocity: Array, step_s: float, robot_q: float, target_q: float) -> PlanarBelief:
    """Move robots by their commanded velocity (n, 2) and the target by its own.

    robot_q, target_q: variances added per step, the latter to the target's velocity if it is modelled
    [m^2 or m^2/s^2].
    """
    mean, covariance = belief.mean.copy(), belief.covariance.copy()
    n = belief.robots
    mean[:n] += step_s * velocity
    noise = np.full(len(mean), robot_q)
    noise[n] = target_q
    if len(mean) > n + 1:
        transition = np.eye(len(mean))
        transition[n, n + 1] = step_s
        mean, covariance = transition @ mean, transition @ covariance @ transition.T
        noise[n], noise[n + 1] = 0.0, target_q
    covariance[np.diag_indices_from(covariance)] += noise
    return PlanarBelief(mean, covariance, n)


def correct(belief: PlanarBelief, observer: int, subject: int, reading: Array, variance: float) -> PlanarBelief:
    """Fuse one relative position reading (2) [m] of subject by observer (-1: the global sensor at the origin)."""
    mean, covariance = belief.mean, belief.covariance
    cross = covariance[:, subject].copy()
    predicted = mean[subject]
    if observer >= 0:
        cross -= covariance[:, observer]
        predicted = predicted - mean[observer]
    innovation_variance = cross[subject] - (cross[observer] if observer >= 0 else 0.0) + variance
    gain = cross / innovation_variance
    updated = covariance - np.outer(gain, cross)
    return PlanarBelief(mean + np.outer(gain, reading - predicted), 0.5 * (updated + updated.T), belief.robots)
