"""A target at constant velocity with white acceleration noise; its heading is a state where markers show it."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from groundstation.arrays import Array, Matrix
from groundstation.estimation.filter_state import Belief
from groundstation.estimation.layout import TARGET_CORE, EntityKind
from groundstation.estimation.model_kernels import MotionKernels
from groundstation.estimation.models.protocol import Vector3
from groundstation.estimation.motion import mirror, wander
from groundstation.estimation.records import VX, VY, X, Y, own_parameters
from groundstation.estimation.register_blocks import add_to_row
from groundstation.kernel import Record, kernel


class ConstantVelocityParameters(Record):
    """Densities of the noise of acceleration [m^2/s^3] and of heading [rad^2/s]."""

    acceleration_density: float
    yaw_density: float


_own = own_parameters(ConstantVelocityParameters)


@kernel()
def add_acceleration_noise(P: Matrix, start: int, axis: int, q: float, dt: float) -> None:
    """Add Q of one axis for white acceleration of density q [m^2/s^3]."""
    position, velocity = start + axis, start + VX + axis
    P[position, position] += q * dt**3 / 3.0
    P[position, velocity] += 0.5 * q * dt * dt
    P[velocity, position] += 0.5 * q * dt * dt
    P[velocity, velocity] += q * dt


@kernel()
def predict_constant_velocity(belief: Belief, e: int, dt: float) -> None:
    """Move a target at constant velocity; its heading wanders."""
    mean, P, entity = belief.mean, belief.P, belief.entities[e]
    start, size, p = entity.start, entity.size, _own(entity)
    for axis in (X, Y):
        mean[start + axis] += dt * mean[start + VX + axis]
        add_to_row(P, start + axis, start + VX + axis, dt)
    for axis in (X, Y):
        for i in range(start, start + size):
            P[i, start + axis] += dt * P[i, start + VX + axis]
        add_acceleration_noise(P, start, axis, p.acceleration_density, dt)
    wander(P, start, entity.at_yaw, p.yaw_density * dt)
    mirror(P, start, size, size)


@dataclass(frozen=True, slots=True)
class ConstantVelocityTarget:
    """A ground vehicle observed only by a marker at a known height, with white acceleration noise.

    acceleration_std_m_s2 lasts for correlation_s; speed_std_m_s: deviation of the speed before the first sighting.
    heading: whether its marker shows its heading, which is then a state with a random walk of turn_std_rad per root
    second.
    """

    kind: ClassVar[EntityKind] = EntityKind.TARGET
    kernels: ClassVar[MotionKernels] = MotionKernels(predict_constant_velocity)
    present: ClassVar[bool] = False
    admitted: ClassVar[bool] = True

    marker_height_m: float = 0.4
    acceleration_std_m_s2: float = 0.3
    correlation_s: float = 0.12
    speed_std_m_s: float = 0.4
    heading: bool = False
    turn_std_rad: float = math.radians(30.0)

    @property
    def labels(self) -> tuple[str, ...]:
        """Return the entries of the block."""
        return (*TARGET_CORE, "yaw") if self.heading else TARGET_CORE

    @property
    def place_m(self) -> Vector3:
        """Return the place of the marker."""
        return 0.0, 0.0, self.marker_height_m

    def own(self) -> ConstantVelocityParameters:
        """Return the parameters that the kernel reads."""
        return ConstantVelocityParameters.row(
            acceleration_density=self.acceleration_std_m_s2**2 * self.correlation_s, yaw_density=self.turn_std_rad**2
        )

    def prior(self) -> Array:
        """Return mean and variances (2, size) of its block when it joins."""
        prior = np.zeros((2, len(self.labels)))
        prior[1, VX] = prior[1, VY] = self.speed_std_m_s**2
        return prior
