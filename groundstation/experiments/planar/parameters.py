"""The planar planning problem's constants."""

import math
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array
from groundstation.experiments.planar.records import PlanarConstants


@dataclass(frozen=True, slots=True)
class PlanarParameters:
    """Sensor, motion and cost constants; defaults are the bench scenario of the planning study.

    sigma_m: std of a relative position reading; range_m, softness_m: limit of readings and its width;
    epsilon_m: rounds the distance at zero, where it has no gradient otherwise;
    robot_noise_m2_s, target_noise_m2_s: process variance rates;
    step_s, steps, discount: the horizon; max_speed_m_s: bound per axis; target_velocity_m_s: predicted mean motion.
    tail: share of a reading's information that is pretended to decay slowly, as r^2 / (r^2 + d^2), so that entities
    out of range still attract.
    PAPER (docs/explanation/method.md 7): no tail; with 0 a lost target or robot gives no gradient.
    Raises ValueError for values without meaning.
    """

    sigma_m: float = 0.05
    range_m: float = 0.5
    softness_m: float = 0.03
    epsilon_m: float = 1e-3
    robot_noise_m2_s: float = 1e-3
    target_noise_m2_s: float = 4e-3
    step_s: float = 0.2
    steps: int = 5
    discount: float = 0.9
    max_speed_m_s: float = 0.25
    target_velocity_m_s: tuple[float, float] = (0.0, 0.0)
    tail: float = 0.0

    def __post_init__(self) -> None:
        positive = ("sigma_m", "range_m", "softness_m", "robot_noise_m2_s", "target_noise_m2_s", "step_s", "discount")
        for name in (*positive, "epsilon_m", "max_speed_m_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name} must be positive and finite (got {value})")
        if not 0.0 <= self.tail < 1.0:
            raise ValueError(f"tail must lie in [0, 1) (got {self.tail})")
        if self.steps < 1:
            raise ValueError(f"steps must be at least 1 (got {self.steps})")

    def constants(self) -> PlanarConstants:
        """Return the constants for the kernels."""
        vx, vy = self.target_velocity_m_s
        return PlanarConstants(
            float(self.sigma_m), float(self.range_m), float(self.softness_m), float(self.epsilon_m), float(self.step_s),
            float(self.discount), float(self.max_speed_m_s), float(vx), float(vy), float(self.tail),
        )  # fmt: skip

    def process_variance(self, robots: int) -> Array:
        """Return the per-step process variance of each entity, target last (robots + 1) [m^2]."""
        variance = np.full(robots + 1, self.robot_noise_m2_s * self.step_s)
        variance[-1] = self.target_noise_m2_s * self.step_s
        return variance


# The parameters with which the paper's Fig. 1 is reproduced (sensor cut at 0.5 m, planned with a margin).
FIGURE_1 = PlanarParameters(sigma_m=0.02, range_m=0.45, softness_m=0.02, robot_noise_m2_s=2e-3, target_noise_m2_s=1e-3)
