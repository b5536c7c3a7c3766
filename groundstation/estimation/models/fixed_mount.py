"""A camera fixed in the world: its mounting errors are states, because every picture shares them."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from groundstation.arrays import Array
from groundstation.estimation.filter_state import Belief
from groundstation.estimation.layout import CARRIER_LABELS, EntityKind
from groundstation.estimation.model_kernels import MotionKernels
from groundstation.estimation.models.protocol import Vector3
from groundstation.estimation.records import own_parameters
from groundstation.kernel import Record, kernel

_AXES = 3


class MountParameters(Record):
    """Drift of the position [m^2/s] and of each angle [rad^2/s]."""

    position_drift: float
    angle_drift: float


_own = own_parameters(MountParameters)


@kernel()
def predict_fixed_mount(belief: Belief, e: int, dt: float) -> None:
    """Increase the uncertainty of a mounting very slowly: mountings creep."""
    entity = belief.entities[e]
    P, p = belief.P, _own(entity)
    for i in range(entity.start, entity.start + _AXES):
        P[i, i] += p.position_drift * dt
        P[i + _AXES, i + _AXES] += p.angle_drift * dt


@dataclass(frozen=True, slots=True)
class FixedMount:
    """The pose of a world-fixed camera [m; world], and its uncertainty.

    Its errors are the same in every picture: as states they do not average out, and knowledge of them from several
    robots is combined. Over `creep_s` the mounting may change by as much as its first uncertainty.
    """

    kind: ClassVar[EntityKind] = EntityKind.CAMERA
    labels: ClassVar[tuple[str, ...]] = CARRIER_LABELS
    kernels: ClassVar[MotionKernels] = MotionKernels(predict_fixed_mount)
    place_m: ClassVar[Vector3] = (0.0, 0.0, 0.0)
    present: ClassVar[bool] = True
    admitted: ClassVar[bool] = True

    position_m: Vector3
    attitude_std_rad: float
    position_std_m: float
    creep_s: float = 3600.0

    def own(self) -> MountParameters:
        """Return the parameters that the kernel reads."""
        return MountParameters.row(
            position_drift=self.position_std_m**2 / self.creep_s, angle_drift=self.attitude_std_rad**2 / self.creep_s
        )

    def prior(self) -> Array:
        """Return mean and variances (2, 6) of its states."""
        variances = [self.position_std_m**2] * 3 + [self.attitude_std_rad**2] * 3
        return np.array([[*self.position_m, 0.0, 0.0, 0.0], variances])
