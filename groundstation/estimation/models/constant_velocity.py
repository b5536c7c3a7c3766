"""A target at constant velocity, moved by white acceleration; its heading is a state where markers show it."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.dispatch import PREDICT
from groundstation.estimation.kernel import address_of, kernel
from groundstation.estimation.layout import TARGET_CORE, EntityKind
from groundstation.estimation.motion import add_row, mirror, wander

ACCELERATION_DENSITY, YAW_DENSITY = s.FIRST_OWN, s.FIRST_OWN + 1


@kernel("void(float64[:,::1], int64, int64, float64, float64)")
def add_acceleration_noise(P: Array, start: int, axis: int, q: float, dt: float) -> None:
    """Add Q of one axis for white acceleration of density q [m^2/s^3]."""
    position, velocity = start + axis, start + s.VX + axis
    P[position, position] += q * dt**3 / 3.0
    P[position, velocity] += 0.5 * q * dt * dt
    P[velocity, position] += 0.5 * q * dt * dt
    P[velocity, velocity] += q * dt


@kernel(PREDICT)
def predict_constant_velocity(
    mean: Array, P: Array, entities: IntArray, parameters: Array, aux: Array, e: int, dt: float
) -> None:
    """Move a target at constant velocity; its heading wanders."""
    start, size = entities[e, s.ENTITY_START], entities[e, s.ENTITY_SIZE]
    for axis in range(2):
        mean[start + axis] += dt * mean[start + s.VX + axis]
        add_row(P, start + axis, start + s.VX + axis, dt)
    for axis in range(2):
        for i in range(start, start + size):
            P[i, start + axis] += dt * P[i, start + s.VX + axis]
        add_acceleration_noise(P, start, axis, parameters[e, ACCELERATION_DENSITY], dt)
    wander(P, start, entities[e, s.AT_YAW], parameters[e, YAW_DENSITY] * dt)
    mirror(P, start, size, size)


@dataclass(frozen=True, slots=True)
class ConstantVelocityTarget:
    """A ground vehicle of which only a marker at a known height is seen; white acceleration moves it.

    acceleration_std_m_s2 lasts for correlation_s; speed_std_m_s is what is believed before it is first seen. heading:
    its marker shows which way it points, and the heading is a state that wanders by turn_std_rad per root second.
    """

    kind: ClassVar[EntityKind] = EntityKind.TARGET
    kernels: ClassVar[tuple[int, int]] = (address_of(predict_constant_velocity), 0)
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

    def row(self) -> Array:
        """Return the parameters in the columns that the kernel reads."""
        row = np.zeros(s.PARAMETER_COLUMNS)
        row[s.PLACE_Z] = self.marker_height_m
        row[ACCELERATION_DENSITY] = self.acceleration_std_m_s2**2 * self.correlation_s
        row[YAW_DENSITY] = self.turn_std_rad**2
        return row

    def prior(self) -> Array:
        """Return mean and variances (2, size) of what joins."""
        prior = np.zeros((2, len(self.labels)))
        prior[1, s.VX] = prior[1, s.VY] = self.speed_std_m_s**2
        return prior
