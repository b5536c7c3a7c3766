"""What hangs fixed in the world (a ceiling camera): its mounting errors are states, as they are in every picture."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.dispatch import PREDICT
from groundstation.estimation.kernel import address_of, kernel
from groundstation.estimation.layout import CARRIER_LABELS, EntityKind
from groundstation.estimation.models.protocol import Vector3

POSITION_DRIFT, ANGLE_DRIFT = s.FIRST_OWN, s.FIRST_OWN + 1


@kernel(PREDICT)
def predict_fixed_mount(
    mean: Array, P: Array, entities: IntArray, parameters: Array, aux: Array, e: int, dt: float
) -> None:
    """Let what is known of a mounting fade very slowly: mountings creep."""
    start = entities[e, s.ENTITY_START]
    for i in range(3):
        P[start + i, start + i] += parameters[e, POSITION_DRIFT] * dt
        P[start + 3 + i, start + 3 + i] += parameters[e, ANGLE_DRIFT] * dt


@dataclass(frozen=True, slots=True)
class FixedMount:
    """Where a world-fixed camera hangs [m; world], and how well that is known.

    Its errors are the same in every picture: as states they do not average out, and what robots learn from each other
    about them is kept. Over `creep_s` the mounting may change by as much as its first uncertainty.
    """

    kind: ClassVar[EntityKind] = EntityKind.CAMERA
    labels: ClassVar[tuple[str, ...]] = CARRIER_LABELS
    kernels: ClassVar[tuple[int, int]] = (address_of(predict_fixed_mount), 0)
    present: ClassVar[bool] = True
    admitted: ClassVar[bool] = True

    position_m: Vector3
    attitude_std_rad: float
    position_std_m: float
    creep_s: float = 3600.0

    def row(self) -> Array:
        """Return the parameters in the columns that the kernel reads."""
        row = np.zeros(s.PARAMETER_COLUMNS)
        row[POSITION_DRIFT] = self.position_std_m**2 / self.creep_s
        row[ANGLE_DRIFT] = self.attitude_std_rad**2 / self.creep_s
        return row

    def prior(self) -> Array:
        """Return mean and variances (2, 6) of its states."""
        variances = [self.position_std_m**2] * 3 + [self.attitude_std_rad**2] * 3
        return np.array([[*self.position_m, 0.0, 0.0, 0.0], variances])
